/** The mesh on the screen: camera, light, materials, and the way from one level to the next. */
import {
  type BufferGeometry, Color, DirectionalLight, DoubleSide, HemisphereLight, type Material, Mesh, MeshBasicMaterial,
  MeshStandardMaterial, PerspectiveCamera, Scene, Spherical, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Triangles } from "./stance";

/** What of a level is shown. */
export interface Frame {
  geometry: BufferGeometry;
  /** Whether its vertices' colours are shown. */
  coloured: boolean;
}

/** The part of the picture that the mesh fills: a level may be smaller than what it grows to. */
const FILLED = 0.8;
/** The camera's height above the horizon, in radians. */
const ELEVATION = 0.33;

export class View {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(35, 1, 0.01, 100);
  private readonly controls: OrbitControls;
  private readonly light = new DirectionalLight(0xffffff, 2.1);
  private readonly sky = new HemisphereLight(0xffffff, 0x8a8f98, 1.5);
  /** 0 where vertices are expected, 1 where they are. */
  private readonly morph = { value: 1 };
  private readonly solid = grows(new MeshStandardMaterial({
    roughness: 0.62, metalness: 0, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
  }), this.morph);
  private readonly edges = grows(new MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.4 }), this.morph);
  private readonly mesh: Mesh<BufferGeometry, MeshStandardMaterial>;
  private readonly wire: Mesh<BufferGeometry, MeshBasicMaterial>;
  private animation: { start: number; milliseconds: number; from: number; to: number; done: () => void } | undefined;
  private asked = false;
  /** What is to be in sight, which way up, and from where: radians around the vertical. */
  private subject: Triangles | undefined;
  private zUp = false;
  private azimuth = 0;
  /** Diagonal of the subject's bounding box. */
  diagonal = 1;
  /** Whether the visitor has turned or moved the mesh. */
  touched = false;

  constructor(private readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.mesh = new Mesh<BufferGeometry, MeshStandardMaterial>(undefined, this.solid);
    this.wire = new Mesh<BufferGeometry, MeshBasicMaterial>(undefined, this.edges);
    this.mesh.frustumCulled = this.wire.frustumCulled = false;
    this.mesh.visible = this.wire.visible = false;
    // The light comes over the spectator's shoulder.
    this.light.position.set(-0.6, 0.9, 1);
    this.camera.add(this.light);
    this.scene.add(this.camera, this.sky, this.mesh, this.wire);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.addEventListener("change", () => this.render());
    this.controls.addEventListener("start", () => (this.touched = true));
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    this.warm();
  }

  /** Shows a frame as it is. Ends an animation, without its end. */
  show(frame: Frame, morph = 1): void {
    this.animation = undefined;
    this.put(frame, morph);
  }

  /** Lets the frame's vertices go from where they are expected to where they are, or back. */
  grow(frame: Frame, direction: "out" | "in", milliseconds: number, done: () => void): void {
    const [from, to] = direction === "out" ? [0, 1] : [1, 0];
    this.put(frame, from);
    this.animation = { start: performance.now(), milliseconds, from, to, done };
  }

  /** Shows nothing. */
  clear(): void {
    this.animation = undefined;
    this.mesh.visible = this.wire.visible = false;
    this.subject = undefined;
    this.touched = false;
    this.render();
  }

  set flat(flat: boolean) {
    this.solid.flatShading = flat;
    this.solid.needsUpdate = true;
    this.render();
  }

  set wireframe(shown: boolean) {
    this.wire.visible = shown && this.mesh.visible;
    this.edges.userData["wanted"] = shown;
    this.render();
  }

  /** Puts a mesh in sight: which way up, and from where, in radians around the vertical. */
  stand(subject: Triangles, zUp: boolean, azimuth: number): void {
    this.mesh.rotation.x = this.wire.rotation.x = zUp ? -Math.PI / 2 : 0;
    Object.assign(this, { subject, zUp, azimuth });
    this.diagonal = diagonalOf(subject) || 1;
    this.reset();
  }

  set dark(dark: boolean) {
    this.solid.userData["plain"] = new Color(dark ? "#aab4c0" : "#c3c9d1");
    this.edges.color.set(dark ? "#05070a" : "#11161d");
    if (!this.solid.vertexColors) this.solid.color.copy(this.solid.userData["plain"] as Color);
    this.render();
  }

  /** Brings all of the mesh into sight. */
  reset(): void {
    if (!this.subject) return;
    this.controls.reset();
    this.touched = false;
    const towards = new Vector3().setFromSphericalCoords(1, Math.PI / 2 - ELEVATION, this.azimuth);
    const right = new Vector3(0, 1, 0).cross(towards).normalize();
    const { center, distance } = this.fit([right, towards.clone().cross(right), towards], this.subject);
    this.camera.position.copy(towards).multiplyScalar(distance).add(center);
    this.camera.near = distance / 1000;
    this.camera.far = distance * 100;
    this.camera.updateProjectionMatrix();
    this.controls.minDistance = this.diagonal / 100;
    this.controls.maxDistance = distance * 20;
    this.controls.target.copy(center);
    this.controls.update();
    this.render();
  }

  /** Where the subject's middle is, and from how far all of it is seen along these axes. */
  private fit(axes: [Vector3, Vector3, Vector3], { positions, indices }: Triangles) {
    const point = new Vector3();
    const corners = (visit: (along: number[]) => void) => {
      for (const v of indices) {
        const [x, y, z] = positions.subarray(3 * v, 3 * v + 3) as unknown as [number, number, number];
        point.set(x, this.zUp ? z : y, this.zUp ? -y : z);
        visit(axes.map((axis) => axis.dot(point)));
      }
    };
    const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
    corners((along) => along.forEach((a, k) => {
      low[k] = Math.min(low[k]!, a);
      high[k] = Math.max(high[k]!, a);
    }));
    const middle = low.map((a, k) => (indices.length > 0 ? (a + high[k]!) / 2 : 0));
    const { aspect, fov } = this.camera;
    const reach = FILLED * Math.tan((fov / 2) * (Math.PI / 180));
    let distance = 0;
    corners(([a, b, c]) => {
      const [across, upwards, nearer] = [a! - middle[0]!, b! - middle[1]!, c! - middle[2]!];
      distance = Math.max(distance, nearer + Math.max(Math.abs(across) / aspect, Math.abs(upwards)) / reach);
    });
    const center = new Vector3();
    axes.forEach((axis, k) => center.addScaledVector(axis, middle[k]!));
    return { center, distance: distance || 1 };
  }

  /** Turns the mesh by angles in radians. */
  turn(right: number, up: number): void {
    const around = new Spherical().setFromVector3(this.camera.position.clone().sub(this.controls.target));
    around.theta -= right;
    around.phi += up;
    around.makeSafe();
    this.touched = true;
    this.camera.position.setFromSpherical(around).add(this.controls.target);
    this.controls.update();
    this.render();
  }

  /** Goes closer by a factor above 1, farther by one below. */
  approach(factor: number): void {
    this.touched = true;
    this.camera.position.sub(this.controls.target).divideScalar(factor).add(this.controls.target);
    this.controls.update();
    this.render();
  }

  private put({ geometry, coloured }: Frame, morph: number): void {
    this.mesh.geometry = this.wire.geometry = geometry;
    this.mesh.visible = true;
    this.wire.visible = this.edges.userData["wanted"] === true;
    this.morph.value = morph;
    if (this.solid.vertexColors !== coloured) {
      this.solid.vertexColors = coloured;
      this.solid.needsUpdate = true;
    }
    if (coloured) this.solid.color.set("#ffffff");
    else this.solid.color.copy(this.solid.userData["plain"] as Color);
    this.render();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    const portrait = this.camera.aspect < 1;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (portrait !== this.camera.aspect < 1 || !this.touched) this.reset();
    // At once: a canvas that was resized is empty until it is drawn.
    this.draw();
  }

  /** Compiles the shaders ahead of the first mesh. */
  private warm(): void {
    this.mesh.visible = true;
    this.renderer.compile(this.scene, this.camera);
    this.mesh.visible = false;
  }

  /** Draws soon, once. */
  private render(): void {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.step();
      if (this.controls.update()) this.render();
      this.draw();
    });
  }

  private draw(): void {
    this.renderer.render(this.scene, this.camera);
  }

  private step(): void {
    const { animation } = this;
    if (!animation) return;
    const { start, milliseconds, from, to, done } = animation;
    const part = Math.min(1, (performance.now() - start) / milliseconds);
    const eased = part * part * (3 - 2 * part);
    this.morph.value = from + (to - from) * eased;
    if (part < 1) return this.render();
    this.animation = undefined;
    done();
  }
}

function diagonalOf({ positions }: Triangles): number {
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  positions.forEach((x, i) => {
    low[i % 3] = Math.min(low[i % 3]!, x);
    high[i % 3] = Math.max(high[i % 3]!, x);
  });
  return positions.length > 0 ? Math.hypot(...low.map((a, k) => high[k]! - a)) : 0;
}

/** A material whose vertices stand between where they are expected and where they are. */
function grows<M extends Material>(material: M, morph: { value: number }): M {
  material.onBeforeCompile = (shader) => {
    shader.uniforms["morph"] = morph;
    // A geometry without these attributes reads zeros, and is shown with morph 1.
    shader.vertexShader = `uniform float morph; attribute vec3 predicted; attribute vec3 predictedNormal;\n${shader.vertexShader}`
      .replace("#include <beginnormal_vertex>",
        "#include <beginnormal_vertex>\nobjectNormal = mix(predictedNormal, objectNormal, max(morph, 0.001));")
      .replace("#include <begin_vertex>", "#include <begin_vertex>\ntransformed = mix(predicted, position, morph);");
  };
  return material;
}
