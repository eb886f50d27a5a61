/** Lines between stations that overlap enough to be registered to each other. */
import { BufferAttribute, BufferGeometry, Color, GLSL3, LineSegments, ShaderMaterial } from 'three';
import { type Slice, sliceOfFloor } from '../floors/cut.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { setColor } from '../scene/building.ts';
import type { Palette } from '../scene/palette.ts';

const VERTEX = 'void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }';
const FRAGMENT = `
precision highp float;
uniform vec3 linkColor;
out vec4 fragColor;
void main() { fragColor = vec4(linkColor, 1.0); }
`;

export class LinkLines {
  readonly lines: LineSegments<BufferGeometry, ShaderMaterial>;
  private readonly color = { value: new Color() };

  constructor(private readonly loaded: LoadedPlan) {
    const material = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: { linkColor: this.color },
      depthTest: false,
      transparent: true,
    });
    this.lines = new LineSegments(new BufferGeometry(), material);
    this.lines.frustumCulled = false;
  }

  /** Show the links that reach the threshold, all or those of one station, between stations that are shown. */
  update(slices: readonly Slice[], isShown: boolean, stationId: string | null): void {
    const { plan, stage } = this.loaded;
    const places = new Map<string, [number, number, number]>();
    for (const { id, floorId, positionM } of stage.stations) {
      const slice = sliceOfFloor(slices, floorId);
      if (slice !== undefined) places.set(id, [positionM[0], positionM[1], positionM[2] + slice.liftM]);
    }
    const ends: number[] = [];
    for (const { a, b, overlap } of plan.registration.links) {
      const [from, to] = [places.get(a), places.get(b)];
      const isWanted = stationId !== null ? a === stationId || b === stationId : isShown;
      if (isWanted && overlap >= plan.registration.threshold && from && to) ends.push(...from, ...to);
    }
    this.lines.geometry.dispose();
    this.lines.geometry = new BufferGeometry();
    this.lines.geometry.setAttribute('position', new BufferAttribute(Float32Array.from(ends), 3));
    this.lines.visible = ends.length > 0;
  }

  setPalette(palette: Palette): void {
    setColor(this.color.value, palette.link);
  }

  dispose(): void {
    this.lines.geometry.dispose();
    this.lines.material.dispose();
  }
}
