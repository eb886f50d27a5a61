/** The cloud of one station in three.js: points rebuilt in the vertex shader from ranges and the beams' angles. */
import {
  BufferAttribute,
  BufferGeometry,
  DataTexture,
  FloatType,
  GLSL3,
  NearestFilter,
  Points,
  RGFormat,
  ShaderMaterial,
} from 'three';
import { type Slice, sliceOfFloor } from '../floors/cut.ts';
import type { ThinnedCloud } from '../load/cloud-rows.ts';
import { CUT_GLSL, cutUniforms, setCut } from '../section/cut-uniforms.ts';
import type { ShownStation } from './shown.ts';
import type { CloudPaint } from './state.ts';
import { stationColor } from './station-color.ts';

/** Narrow enough for every WebGL 2 implementation; scans may have more rows. */
const ANGLES_WIDTH = 2048;
const PAINT_MODES: Readonly<Record<CloudPaint, number>> = { range: 0, incidence: 1, intensity: 2, station: 3 };

const VERTEX = /* glsl */ `
uniform highp sampler2D angles; // radians, one texel a row: its elevation, and the azimuth of its first beam
uniform int columns;
uniform float azimuthStep, rangeStep, farthest, pixelRatio;
uniform vec3 origin; // of the sensor
uniform int paintMode; // 0 range, 1 incidence, 2 intensity, 3 station
uniform vec3 stationColor;
in float steps;
in float intensity;
out vec3 vPlace;
out vec3 vColor;
// Dark blue over green to yellow, and near to far; close to viridis, by a cubic in each channel.
vec3 ramp(float t) {
  vec3 a = vec3(0.27, 0.01, 0.33), b = vec3(0.19, 0.41, 0.56), c = vec3(0.21, 0.72, 0.47), d = vec3(0.99, 0.91, 0.14);
  t = clamp(t, 0.0, 1.0) * 3.0;
  return t < 1.0 ? mix(a, b, t) : t < 2.0 ? mix(b, c, t - 1.0) : mix(c, d, t - 2.0);
}
void main() {
  int row = gl_VertexID / columns;
  vec2 angle = texelFetch(angles, ivec2(row % ${ANGLES_WIDTH}, row / ${ANGLES_WIDTH}), 0).rg;
  float elevation = angle.x, azimuth = angle.y + float(gl_VertexID % columns) * azimuthStep;
  float range = steps * rangeStep;
  vec3 beam = vec3(cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation));
  vec3 local = range * beam;
  vPlace = local + origin;
  vColor = paintMode == 0 ? ramp(range / farthest)
    : paintMode == 1 ? ramp(1.0 - acos(clamp(intensity, 0.0, 1.0)) / 1.5707963)
    : paintMode == 2 ? vec3(0.15 + 0.85 * intensity)
    : stationColor * (0.55 + 0.45 * intensity);
  vec4 seen = modelViewMatrix * vec4(local, 1.0);
  gl_Position = steps > 0.0 ? projectionMatrix * seen : vec4(2.0, 2.0, 2.0, 1.0);
  gl_PointSize = pixelRatio * clamp(22.0 / -seen.z, 1.5, 4.0);
}
`;
const FRAGMENT = /* glsl */ `
precision highp float;
uniform vec2 slice;
${CUT_GLSL}
in vec3 vPlace;
in vec3 vColor;
out vec4 fragColor;
void main() {
  if (isCutAway(vPlace) || vPlace.z < slice.x || vPlace.z > slice.y) discard;
  fragColor = vec4(vColor, 1.0);
}
`;

export class CloudPoints {
  readonly points: Points<BufferGeometry, ShaderMaterial>;
  private readonly angles: DataTexture;
  private readonly cut = cutUniforms();

  constructor(
    readonly thinned: ThinnedCloud,
    private readonly station: ShownStation,
  ) {
    const { cloud, beams } = thinned;
    const geometry = new BufferGeometry();
    geometry.setAttribute('steps', new BufferAttribute(cloud.rangeSteps, 1));
    geometry.setAttribute('intensity', new BufferAttribute(cloud.intensity, 1, true));
    geometry.setDrawRange(0, cloud.rangeSteps.length);
    const nTextureRows = Math.ceil(beams.rows / ANGLES_WIDTH);
    const angles = new Float32Array(2 * ANGLES_WIDTH * nTextureRows);
    for (let row = 0; row < beams.rows; row++) {
      angles[2 * row] = beams.elevationsRad[row];
      angles[2 * row + 1] = beams.azimuthsRad[row];
    }
    this.angles = new DataTexture(angles, ANGLES_WIDTH, nTextureRows, RGFormat, FloatType);
    this.angles.internalFormat = 'RG32F';
    this.angles.minFilter = this.angles.magFilter = NearestFilter;
    this.angles.needsUpdate = true;
    const material = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: {
        angles: { value: this.angles },
        columns: { value: beams.columns },
        azimuthStep: { value: beams.azimuthStepRad },
        rangeStep: { value: beams.rangeStepM },
        farthest: { value: 1 },
        pixelRatio: { value: Math.min(2, window.devicePixelRatio) },
        ...this.cut,
        origin: { value: [...station.positionM] },
        paintMode: { value: 0 },
        stationColor: { value: stationColor(station.order) },
        slice: { value: [-1e9, 1e9] },
      },
    });
    this.points = new Points(geometry, material);
    // Its positions are known to the shader only.
    this.points.frustumCulled = false;
  }

  setSlices(slices: readonly Slice[]): void {
    const slice = sliceOfFloor(slices, this.station.floorId);
    this.points.visible = slice !== undefined;
    if (slice === undefined) return;
    const [x, y, z] = this.station.positionM;
    this.points.position.set(x, y, z + slice.liftM);
    setCut(this.cut, slice.planes ?? []);
    this.points.material.uniforms.slice.value = [Math.max(-1e9, slice.bottomM), Math.min(1e9, slice.topM)];
  }

  setPaint(paint: CloudPaint, farthestM: number): void {
    this.points.material.uniforms.paintMode.value = PAINT_MODES[paint];
    this.points.material.uniforms.farthest.value = farthestM;
  }

  dispose(): void {
    this.points.geometry.dispose();
    this.points.material.dispose();
    this.angles.dispose();
  }
}

/** A range that all but the farthest hundredth of the returns are within, metres. */
export function usualRangeM({ cloud, beams }: ThinnedCloud): number {
  const counts = new Uint32Array(256);
  for (const steps of cloud.rangeSteps) if (steps > 0) counts[steps >> 8]++;
  let sum = 0;
  for (let bin = 0; bin < 256; bin++) {
    sum += counts[bin];
    if (sum >= 0.99 * cloud.nReturns && sum > 0) return (bin + 1) * 256 * beams.rangeStepM;
  }
  return 1;
}
