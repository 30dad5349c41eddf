/** A slow, long way for datagrams, between a client and a server on this machine. */
import { createSocket, type Socket } from "node:dgram";
import { once } from "node:events";
import type { AddressInfo } from "node:net";

export interface Radio {
  /** Where the client finds the server. */
  port: number;
  close(): void;
}

/** Passes datagrams on to a server's port, each after `delay` milliseconds, those to the client at most so many in a second. */
export async function radio(server: number, perSecond: number, delay: number): Promise<Radio> {
  const ways = new Map<number, Socket>();
  let closed = false;
  const front = createSocket("udp4");
  const back = (client: number): Socket => {
    const socket = createSocket("udp4");
    let due = 0;
    socket.on("message", (datagram) => {
      due = Math.max(due, performance.now()) + 1000 / perSecond;
      pass(front, datagram, client, due - performance.now() + delay);
    });
    ways.set(client, socket);
    return socket;
  };
  const pass = (by: Socket, datagram: Buffer, port: number, after: number) => setTimeout(() => {
    if (!closed) by.send(datagram, port, "127.0.0.1");
  }, after);
  front.on("message", (datagram, { port }) => pass(ways.get(port) ?? back(port), datagram, server, delay));
  front.bind(0, "127.0.0.1");
  await once(front, "listening");
  const close = () => {
    closed = true;
    for (const socket of [front, ...ways.values()]) socket.close();
  };
  return { port: (front.address() as AddressInfo).port, close };
}
