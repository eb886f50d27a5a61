/** The canvas: renderer, camera, orbit controls, and a picture drawn only when something changed. */
import {
  type Camera,
  Color,
  MOUSE,
  OrthographicCamera,
  PerspectiveCamera,
  type Ray,
  Raycaster,
  Scene,
  TOUCH,
  Vector2,
  Vector3,
  WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import type { Extent } from '../floors/cut.ts';
import {
  type Covered,
  type Flight,
  flightAt,
  homeView,
  orbited,
  straightAbove,
  type View,
  type Whence,
} from './camera.ts';
import type { Palette } from './palette.ts';

const FIELD_OF_VIEW_DEG = 34;
const WIDE_FIELD_OF_VIEW_DEG = 62;
const FLIGHT_MS = 650;
/** Room around a section, for the bars above it. */
const FACING_MARGIN = 1.3;
/** More pixels than this cost time that nobody sees. */
const MOST_PIXEL_RATIO = 2;

/**
 * `plan` and `facing` are orthographic, so that lengths can be read off: straight from above with +y up, and level. As much is in the picture as
 * in perspective at the distance of what is looked at, so that coming closer works alike.
 */
export type Projection = 'perspective' | 'plan' | 'facing';

export class Viewport {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.05, 1000);
  /** Called after each drawn frame, for what lies over the canvas. */
  onFrame: () => void = () => undefined;
  /** Called when the user has moved the camera: position and target. */
  onMovedByHand: (pose: readonly number[]) => void = () => undefined;
  /** Called when the camera sets out for a place of the program's choice. */
  onFlight: () => void = () => undefined;
  /** Called with the size of the canvas in CSS pixels, at once and whenever it changes. */
  set onResize(listener: (width: number, height: number) => void) {
    this.resizeListener = listener;
    this.resize();
  }
  private resizeListener: (width: number, height: number) => void = () => undefined;
  /** Null: the browser gives no WebGL. All but the picture is as with it. */
  private readonly renderer: WebGLRenderer | null;
  private readonly controls: OrbitControls;
  private readonly resizing: ResizeObserver;
  private readonly background = new Color();
  private readonly flat = new OrthographicCamera();
  private projection: Projection = 'perspective';
  private flight: Flight | null = null;
  private isScheduled = false;
  private isDisposed = false;
  private hasPicture = true;
  /** From what is looked at to where the camera was while there was a picture. */
  private away: Vector3 | null = null;

  /** onPicture : called with whether there is a picture, at once and whenever the browser takes it away or gives it back. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly onPicture: (hasPicture: boolean) => void,
  ) {
    const look = { antialias: true, powerPreference: 'high-performance' } as const;
    // First whether there is one: three.js would write an error to the console.
    this.renderer = canvas.getContext('webgl2', look) === null ? null : new WebGLRenderer({ canvas, ...look });
    this.setDetail(1);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.zoomToCursor = true;
    this.controls.screenSpacePanning = true;
    this.controls.maxPolarAngle = Math.PI * 0.97;
    this.controls.addEventListener('change', () => this.requestFrame());
    this.controls.addEventListener('start', () => {
      this.flight = null;
    });
    let before: readonly number[] = [];
    this.controls.addEventListener('start', () => {
      before = this.pose();
    });
    this.controls.addEventListener('end', () => {
      const pose = this.pose();
      // A click begins and ends a movement too.
      if (pose.some((value, i) => Math.abs(value - before[i]) > 1e-6)) this.onMovedByHand(pose);
    });
    // Called after those of three.js, which makes anew what was on the graphics card.
    canvas.addEventListener('webglcontextlost', () => this.setPicture(false));
    canvas.addEventListener('webglcontextrestored', () => this.setPicture(true));
    this.setPicture(this.renderer !== null);
    this.resizing = new ResizeObserver(() => this.resize());
    this.resizing.observe(canvas.parentElement ?? canvas);
    this.resize();
  }

  setPalette(palette: Palette): void {
    // Not through Color.set: the shaders here write screen colours, and the clear colour must match theirs.
    this.background.set(palette.background);
    this.renderer?.setClearColor(this.background);
    this.requestFrame();
  }

  /** Draw a share of the pixels across and down: for pictures that keep changing on machines that draw slowly. */
  setDetail(share: number): void {
    this.renderer?.setPixelRatio(share * Math.min(MOST_PIXEL_RATIO, window.devicePixelRatio));
    this.requestFrame();
  }

  /** A narrow view flattens little; inside a room one sees nothing with it. */
  setWide(isWide: boolean): void {
    this.camera.fov = isWide ? WIDE_FIELD_OF_VIEW_DEG : FIELD_OF_VIEW_DEG;
    this.requestFrame();
  }

  /** Drawn with perspective or without; without it a drag shifts the picture, which does not turn. */
  setProjection(projection: Projection): void {
    this.projection = projection;
    const isFlat = projection !== 'perspective';
    this.controls.enableRotate = !isFlat;
    this.controls.mouseButtons.LEFT = isFlat ? MOUSE.PAN : MOUSE.ROTATE;
    this.controls.touches.ONE = isFlat ? TOUCH.PAN : TOUCH.ROTATE;
    this.requestFrame();
  }

  /** While something else is dragged, the camera stands still. */
  holdCamera(isHeld: boolean): void {
    this.controls.enabled = !isHeld;
  }

  /** Put the camera at a pose: position and target. */
  place([x, y, z, ...target]: readonly number[]): void {
    this.flight = null;
    this.camera.position.set(x, y, z);
    this.controls.target.fromArray(target);
    if (!this.hasPicture)
      this.camera.position.copy(straightAbove({ position: this.camera.position, target: this.target() }));
    this.requestFrame();
  }

  /** The camera goes round what is looked at, as if by hand. */
  orbit(turnRad: number, tiltRad: number, closer: number): void {
    const { target } = this.controls;
    this.place([...orbited({ position: this.camera.position, target }, turnRad, tiltRad, closer), ...target.toArray()]);
    this.onMovedByHand(this.pose());
  }

  /** Copy the picture into another canvas; drawn anew, for the browser keeps it only until it is on the screen. */
  copyPicture(into: HTMLCanvasElement): void {
    this.draw(performance.now());
    [into.width, into.height] = [this.canvas.width, this.canvas.height];
    into.getContext('2d')?.drawImage(this.canvas, 0, 0);
  }

  /** Which way the camera looks, counterclockwise from +x. */
  heading(): number {
    const ahead = this.controls.target.clone().sub(this.camera.position);
    return Math.atan2(ahead.y, ahead.x);
  }

  /** Where the camera is, and what it looks at. */
  pose(): readonly number[] {
    return [...this.camera.position.toArray(), ...this.controls.target.toArray()];
  }

  /** What is looked at. */
  target(): Vector3 {
    return this.controls.target.clone();
  }

  /** Draw soon; many calls before the next frame draw once. */
  requestFrame(): void {
    if (this.isScheduled || this.isDisposed) return;
    this.isScheduled = true;
    requestAnimationFrame((now) => {
      this.isScheduled = false;
      if (!this.isDisposed) this.draw(now);
    });
  }

  /** Show all of `extent` in what panels leave of the picture. */
  showAll(extent: Extent, from: Whence, covered: Covered, isInstant = false): void {
    const lens = { fieldOfViewDeg: FIELD_OF_VIEW_DEG, aspect: this.camera.aspect };
    this.flyTo(homeView(extent, from, lens, covered), isInstant);
    const size = Math.hypot(...extent.maxM.map((max, i) => max - extent.minM[i]));
    this.controls.minDistance = 0.1;
    this.controls.maxDistance = 6 * size;
    this.camera.far = 20 * size;
  }

  /** Show a part of what is drawn in what panels leave of the picture, from the side or straight from above. */
  showPart(extent: Extent, from: 'side' | 'top', covered: Covered): void {
    const lens = { fieldOfViewDeg: FIELD_OF_VIEW_DEG, aspect: this.camera.aspect };
    this.flyTo(homeView(extent, from, lens, covered));
  }

  /** Look level at a place, so that a width and a height around it fill the picture. */
  face(place: Vector3, [x, y]: readonly [number, number], widthM: number, heightM: number): void {
    const halfM = FACING_MARGIN * Math.max(heightM / 2, widthM / 2 / this.camera.aspect, 0.5);
    const distanceM = halfM / Math.tan((FIELD_OF_VIEW_DEG * Math.PI) / 360);
    const position = place.clone().addScaledVector(new Vector3(x, y, 0), -distanceM);
    this.flyTo({ position, target: place.clone() });
  }

  /** Look at a place from where the camera is now, as near as `distanceM`. */
  approach(place: Vector3, distanceM: number): void {
    const from = this.camera.position.clone().sub(this.controls.target).normalize();
    const distance = Math.min(distanceM, this.camera.position.distanceTo(this.controls.target));
    this.flyTo({ target: place.clone(), position: place.clone().addScaledVector(from, distance) });
  }

  /** Where on the page the picture is. */
  box(): DOMRect {
    return this.canvas.getBoundingClientRect();
  }

  /** The ray under a place of the page, in CSS pixels. */
  rayAt(clientX: number, clientY: number): Ray {
    const box = this.canvas.getBoundingClientRect();
    const at = new Vector2(((clientX - box.left) / box.width) * 2 - 1, 1 - ((clientY - box.top) / box.height) * 2);
    const raycaster = new Raycaster();
    const eye = this.eye();
    raycaster.setFromCamera(at, eye);
    // Without perspective, what is behind the camera is drawn too.
    if (eye === this.flat) raycaster.ray.origin.addScaledVector(raycaster.ray.direction, -this.flat.far);
    return raycaster.ray;
  }

  /** The ray from the eye to a place, and how far along it the place is. */
  rayTo(place: Vector3): { readonly ray: Ray; readonly distanceM: number } {
    const at = place.clone().project(this.eye());
    const box = this.canvas.getBoundingClientRect();
    const ray = this.rayAt(box.left + ((at.x + 1) / 2) * box.width, box.top + ((1 - at.y) / 2) * box.height);
    return { ray, distanceM: place.clone().sub(ray.origin).dot(ray.direction) };
  }

  /** Metres that a CSS pixel is wide at a place; without one, at what is looked at. */
  metresPerPixel(place: Vector3 = this.controls.target): number {
    const { position, fov } = this.camera;
    const isFlat = this.projection !== 'perspective';
    const ahead = this.controls.target.clone().sub(position);
    const farM = isFlat ? ahead.length() : place.clone().sub(position).dot(ahead.normalize());
    return (2 * Math.max(farM, 0) * Math.tan((fov * Math.PI) / 360)) / Math.max(1, this.canvas.clientHeight);
  }

  /** Place of a point on the canvas in CSS pixels; null behind the camera. */
  project(pointM: Vector3): { x: number; y: number } | null {
    const at = pointM.clone().project(this.eye());
    if (at.z > 1 || at.z < -1) return null;
    return { x: ((at.x + 1) / 2) * this.canvas.clientWidth, y: ((1 - at.y) / 2) * this.canvas.clientHeight };
  }

  dispose(): void {
    this.isDisposed = true;
    this.resizing.disconnect();
    this.controls.dispose();
    this.renderer?.dispose();
  }

  /** Move the camera to a view, at once where motion is not wanted. */
  flyTo(to: View, isInstant = false): void {
    // A plan that flies is no help.
    const isCalm = isInstant || !this.hasPicture || window.matchMedia('(prefers-reduced-motion: reduce)').matches;
    this.onFlight();
    const from = { position: this.camera.position.clone(), target: this.controls.target.clone() };
    if (isCalm) {
      // At once, not with the next frame: what comes before it may go on from there.
      this.place([...to.position.toArray(), ...to.target.toArray()]);
      return;
    }
    this.flight = { from, to, start: performance.now(), durationMs: FLIGHT_MS };
    this.requestFrame();
  }

  /** Without a picture it is looked straight down, with it again from where it was before. */
  private setPicture(hasPicture: boolean): void {
    if (this.isDisposed) return;
    this.hasPicture = hasPicture;
    const [back, target] = [this.away, this.target()];
    const away = this.camera.position.clone().sub(target);
    this.away = hasPicture ? null : away;
    if (!hasPicture) this.place(this.pose());
    else if (back !== null) this.camera.position.copy(target).add(back.setLength(away.length()));
    // It is not among what three.js makes anew.
    this.renderer?.setClearColor(this.background);
    this.onPicture(hasPicture);
    this.requestFrame();
  }

  private draw(now: number): void {
    if (this.flight !== null) {
      const { view, isOver } = flightAt(this.flight, now);
      this.camera.position.copy(view.position);
      this.controls.target.copy(view.target);
      if (isOver) this.flight = null;
      else this.requestFrame();
    }
    this.controls.update();
    // As far off as the view allows: thin panes and touching walls need the depth buffer's precision.
    this.camera.near = this.camera.position.distanceTo(this.controls.target) / 40;
    this.camera.updateProjectionMatrix();
    this.renderer?.render(this.scene, this.eye());
    this.onFrame();
  }

  /** The camera that the picture is drawn with, as things stand now. */
  private eye(): Camera {
    const { camera, flat, projection } = this;
    if (projection === 'perspective') {
      camera.updateMatrixWorld();
      return camera;
    }
    const target = this.controls.target;
    const halfM = camera.position.distanceTo(target) * Math.tan((camera.fov * Math.PI) / 360);
    [flat.left, flat.right, flat.top, flat.bottom] = [-halfM * camera.aspect, halfM * camera.aspect, halfM, -halfM];
    [flat.near, flat.far] = [-camera.far, camera.far];
    flat.position.copy(camera.position);
    flat.quaternion.copy(camera.quaternion);
    if (projection === 'plan') {
      flat.position.setX(target.x).setY(target.y);
      flat.quaternion.identity();
    }
    flat.updateProjectionMatrix();
    flat.updateMatrixWorld();
    return flat;
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement ?? this.canvas;
    if (width === 0 || height === 0) return;
    this.renderer?.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.resizeListener(width, height);
    this.requestFrame();
  }
}
