//! Sessions over real sockets between two network namespaces, whose packets the kernel drops.
//!
//! It needs the right to make namespaces (root), and the programs `ip` and `nft`. Where those are not to
//! be had the test says so and passes; losses are then tried on loopback, in `webtransport`, and in the
//! library's channel models.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Output, Stdio};

use crate::site::{folder, tct};
use tercet::shapes;

const SERVER: &str = "10.99.0.1";
const CLIENT: &str = "10.99.0.2";
/// Packets of a hundred that are dropped, each way.
const LOSS: u32 = 10;

/// Two namespaces with a cable between them. They go when this is dropped.
struct Cable {
    ends: [String; 2],
}

impl Cable {
    /// The cable, or what does not work here.
    fn new() -> Result<Cable, String> {
        let end = |end| format!("tercet-{}-{end}", std::process::id());
        let cable = Cable { ends: [end("server"), end("client")] };
        let [server, client] = &cable.ends;
        for name in &cable.ends {
            run(&format!("ip netns add {name}"))?;
        }
        run(&format!("ip link add wire netns {server} type veth peer name wire netns {client}"))?;
        for (name, address) in cable.ends.iter().zip([SERVER, CLIENT]) {
            run(&format!("ip -n {name} address add {address}/24 dev wire"))?;
            run(&format!("ip -n {name} link set wire up"))?;
        }
        Ok(cable)
    }

    /// Lets both ends lose what arrives.
    fn lose(&self) -> Result<(), String> {
        for name in &self.ends {
            let rules = [
                "add table netdev loss".into(),
                "add chain netdev loss in { type filter hook ingress device wire priority 0 ; }".into(),
                format!("add rule netdev loss in numgen random mod 100 < {LOSS} counter drop"),
            ];
            for rule in rules {
                run(&format!("ip netns exec {name} nft {rule}"))?;
            }
        }
        Ok(())
    }

    /// Packets that were dropped on their way to an end.
    fn lost(&self, end: usize) -> u32 {
        let rules = run(&format!("ip netns exec {} nft list chain netdev loss in", self.ends[end])).unwrap();
        let rules = String::from_utf8(rules.stdout).unwrap();
        rules.split("counter packets ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap()
    }

    /// The command at an end.
    fn tercet(&self, end: usize) -> Command {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", &self.ends[end], env!("CARGO_BIN_EXE_tercet")]);
        command
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        for name in &self.ends {
            // One that was never made need not go.
            let _ = run(&format!("ip netns delete {name}"));
        }
    }
}

fn run(words: &str) -> Result<Output, String> {
    let mut words = words.split(' ');
    let output = Command::new(words.next().unwrap()).args(words).output();
    match output.map_err(|error| format!("ip: {error}"))? {
        output if output.status.success() => Ok(output),
        output => Err(String::from_utf8_lossy(&output.stderr).trim().into()),
    }
}

/// A process that ends with the test.
struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        let _ = (self.0.kill(), self.0.wait());
    }
}

#[test]
fn a_file_arrives_by_a_link_that_drops_packets() {
    let cable = match Cable::new().and_then(|cable| cable.lose().map(|()| cable)) {
        Ok(cable) => cable,
        Err(why) => return eprintln!("not tried between network namespaces: {why}"),
    };
    let folder = folder("namespaces");
    let file = tct(&shapes::scan(30_000, 1));
    std::fs::write(folder.join("site/scan.tct"), &file).unwrap();
    let mut serve = cable.tercet(0);
    serve.args(["serve", "site", "--webtransport", "--cache", "cache", "--quiet", "--addr"]);
    serve.arg(format!("{SERVER}:8080")).current_dir(&folder).stdout(Stdio::piped());
    let mut server = Server(serve.spawn().unwrap());
    let mut address = String::new();
    BufReader::new(server.0.stdout.take().unwrap()).read_line(&mut address).unwrap();

    let url = format!("{}scan.tct", address.trim());
    let mut fetch = cable.tercet(1);
    fetch.args(["fetch", &url, "-o", "out.tct", "--protocol", "wt"]).current_dir(&folder);
    let output = fetch.output().unwrap();
    assert!(output.status.success(), "{output:?}");
    assert!(std::fs::read(folder.join("out.tct")).unwrap() == file);
    assert!(cable.lost(1) > 0, "nothing was dropped on the way to the client");
}
