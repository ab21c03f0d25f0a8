// The set-up of a test in three dimensions: paths of the balls in R, rotary axes, and the balls and the bar at one
// position of the test. The balls are handles.

import {
  AmbientLight,
  AxesHelper,
  BufferGeometry,
  Color,
  CylinderGeometry,
  DirectionalLight,
  Line,
  LineBasicMaterial,
  LineDashedMaterial,
  Mesh,
  MeshStandardMaterial,
  type Object3D,
  PerspectiveCamera,
  Plane,
  Raycaster,
  Scene,
  SphereGeometry,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

type Point = [number, number, number];

/** A position of a test: of each axis, deg or mm, and the images of the unit vectors of table and tool in R. */
export interface Stop {
  at: number[];
  table: [Point, Point, Point];
  tool: [Point, Point, Point];
}

export interface SetUp {
  table_point_mm: Point | null;
  tool_point_mm: Point;
  table_path_mm: Point[];
  tool_path_mm: Point[];
  /** The positions at the points of the paths. */
  stops: Stop[];
  axis_lines: { name: string; point_mm: Point; direction: Point }[];
}

type Ball = "workpiece_ball_mm" | "spindle_ball_mm";

/** Which ball is dragged to where in the frame that carries it, mm. */
export type Dragged = (ball: Ball, to: Point) => void;

/** A frame that lies as R does. */
const UPRIGHT: Point[] = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];

const vector = (point: Point) => new Vector3(...point);

interface Handle {
  mesh: Mesh;
  ball: Ball;
  /** Where the ball is in its frame, and in R. */
  own: Point;
  inR: Point;
  /** The images of the unit vectors of its frame in R. */
  turned: Vector3[];
}

/** Where a ball in R is in its frame, to a tenth of a millimetre. */
function inFrame({ own, inR, turned }: Handle, to: Vector3): Point {
  const moved = to.clone().sub(vector(inR));
  return own.map((mm, k) => Math.round((mm + turned[k].dot(moved)) * 10) / 10) as Point;
}

/** Where a ball of its frame is in R. */
function inReference({ own, inR, turned }: Handle, to: Point): Vector3 {
  return to.reduce((at, mm, k) => at.addScaledVector(turned[k], mm - own[k]), vector(inR));
}

export class SetUpScene {
  private renderer: WebGLRenderer;
  private scene = new Scene();
  private camera = new PerspectiveCamera(40, 1, 1, 20_000);
  private controls: OrbitControls;
  private drawn: Object3D[] = [];
  private handles: Handle[] = [];
  private held?: { handle: Handle; plane: Plane };
  private framed = false;

  constructor(
    private canvas: HTMLCanvasElement,
    private dragged: Dragged,
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.render());
    this.scene.add(new AmbientLight(0xffffff, 1.5));
    const light = new DirectionalLight(0xffffff, 2);
    light.position.set(1, 2, 3);
    this.scene.add(light);
    canvas.addEventListener("pointerdown", this.down);
    canvas.addEventListener("pointermove", this.move);
    canvas.addEventListener("pointerup", this.up);
    canvas.addEventListener("pointercancel", this.up);
  }

  /** Shows a set-up at one of its positions. */
  show(setUp: SetUp, position: number): void {
    for (const object of this.drawn) {
      this.scene.remove(object);
      if (object instanceof Line || object instanceof Mesh) {
        object.geometry.dispose();
        (object.material as LineBasicMaterial).dispose();
      }
    }
    this.drawn = [];
    const held = this.held?.handle.ball;
    this.handles = [];
    const points = [...setUp.table_path_mm, ...setUp.tool_path_mm, setUp.tool_point_mm, [0, 0, 0] as Point];
    const extent = Math.max(50, ...points.map((point) => Math.hypot(...point)));
    this.add(new AxesHelper(extent * 0.5));
    this.path(setUp.table_path_mm, 0x2a7fba);
    this.path(setUp.tool_path_mm, 0xd1495b);
    const every = Math.max(1, Math.floor(setUp.table_path_mm.length / 12));
    setUp.table_path_mm.forEach((point, k) => {
      if (k % every === 0 && setUp.tool_path_mm[k]) this.path([point, setUp.tool_path_mm[k]], 0x9aa5b1);
    });
    for (const { point_mm, direction } of setUp.axis_lines) {
      const half = vector(direction).multiplyScalar(extent);
      const ends = [vector(point_mm).sub(half), vector(point_mm).add(half)];
      const material = new LineDashedMaterial({ color: 0x8a93a0, dashSize: 8, gapSize: 6 });
      const line = new Line(new BufferGeometry().setFromPoints(ends), material);
      line.computeLineDistances();
      this.add(line);
    }
    const k = Math.min(position, setUp.stops.length - 1);
    const stop: Stop | undefined = setUp.stops[k];
    if (setUp.table_point_mm) {
      const at = setUp.table_path_mm[k] ?? setUp.table_point_mm;
      this.ball("workpiece_ball_mm", setUp.table_point_mm, at, stop?.table, 0x2a7fba, extent);
    }
    const at = setUp.tool_path_mm[k] ?? setUp.tool_point_mm;
    this.ball("spindle_ball_mm", setUp.tool_point_mm, at, stop?.tool, 0xd1495b, extent);
    this.bar(extent);
    const again = this.handles.find((handle) => handle.ball === held);
    if (this.held && again) this.held.handle = again;
    if (!this.framed) {
      this.camera.position.set(1.9 * extent, -1.9 * extent, 1.3 * extent);
      this.controls.update();
      this.framed = true;
    }
    this.render();
  }

  /** Draws at the present size of the canvas. */
  render = (): void => {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.renderer.render(this.scene, this.camera);
  };

  /** The place of a ball on the canvas, CSS pixels from its corner. */
  place(ball: string): { x: number; y: number } | undefined {
    const handle = this.handles.find((one) => one.ball === ball);
    if (!handle) return undefined;
    const at = handle.mesh.position.clone().project(this.camera);
    return { x: ((at.x + 1) / 2) * this.canvas.clientWidth, y: ((1 - at.y) / 2) * this.canvas.clientHeight };
  }

  /** Where a ball is drawn in R, mm. */
  point(ball: string): Point | undefined {
    return this.handles.find((one) => one.ball === ball)?.mesh.position.toArray();
  }

  dispose(): void {
    this.controls.dispose();
    this.renderer.dispose();
  }

  private add(object: Object3D): void {
    this.scene.add(object);
    this.drawn.push(object);
  }

  private path(points: Point[], colour: number): void {
    if (points.length < 2) return;
    const geometry = new BufferGeometry().setFromPoints(points.map(vector));
    this.add(new Line(geometry, new LineBasicMaterial({ color: new Color(colour) })));
  }

  private ball(ball: Ball, own: Point, inR: Point, turned: Point[] = UPRIGHT, colour: number, extent: number): void {
    const mesh = new Mesh(new SphereGeometry(extent * 0.05, 24, 16), new MeshStandardMaterial({ color: colour }));
    mesh.position.copy(vector(inR));
    this.add(mesh);
    this.handles.push({ mesh, ball, own, inR, turned: turned.map(vector) });
  }

  /** The bar between the balls. */
  private bar(extent: number): void {
    const [one, other] = this.handles.map(({ mesh }) => mesh.position);
    if (!other || one.distanceTo(other) === 0) return;
    const along = other.clone().sub(one);
    const geometry = new CylinderGeometry(extent * 0.012, extent * 0.012, along.length(), 12);
    const mesh = new Mesh(geometry, new MeshStandardMaterial({ color: 0x9aa5b1 }));
    mesh.position.copy(one).addScaledVector(along, 0.5);
    mesh.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), along.normalize());
    this.add(mesh);
  }

  private ray(event: PointerEvent): Raycaster {
    const box = this.canvas.getBoundingClientRect();
    const at = new Vector2(
      ((event.clientX - box.left) / box.width) * 2 - 1,
      1 - ((event.clientY - box.top) / box.height) * 2,
    );
    const ray = new Raycaster();
    ray.setFromCamera(at, this.camera);
    return ray;
  }

  private down = (event: PointerEvent): void => {
    const [hit] = this.ray(event).intersectObjects(this.handles.map((handle) => handle.mesh));
    const handle = this.handles.find((one) => one.mesh === hit?.object);
    if (!handle) return;
    this.controls.enabled = false;
    this.canvas.setPointerCapture(event.pointerId);
    const normal = this.camera.getWorldDirection(new Vector3());
    this.held = { handle, plane: new Plane().setFromNormalAndCoplanarPoint(normal, handle.mesh.position) };
  };

  private move = (event: PointerEvent): void => {
    if (!this.held) return;
    const to = this.ray(event).ray.intersectPlane(this.held.plane, new Vector3());
    if (!to) return;
    const { handle } = this.held;
    const own = inFrame(handle, to);
    handle.mesh.position.copy(inReference(handle, own));
    this.render();
    this.dragged(handle.ball, own);
  };

  private up = (): void => {
    this.held = undefined;
    this.controls.enabled = true;
  };
}
