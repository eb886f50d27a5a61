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
import type { Slice } from '../floors/cut.ts';
import type { Cloud } from '../load/cloud.ts';
import type { StageStation } from '../load/stage.ts';
import type { CloudPaint } from '../store.ts';

const VERTEX = /* glsl */ `
uniform highp sampler2D angles; // radians, one texel a row: its elevation, and the azimuth of its first beam
uniform int columns;
uniform float azimuthStep, rangeStep, farthest, pixelRatio, height;
uniform bool paintsRange;
in float steps;
in float intensity;
out float vHeight;
out vec3 vColor;
// Dark blue over green to yellow, and near to far; close to viridis, by a cubic in each channel.
vec3 ramp(float t) {
  vec3 a = vec3(0.27, 0.01, 0.33), b = vec3(0.19, 0.41, 0.56), c = vec3(0.21, 0.72, 0.47), d = vec3(0.99, 0.91, 0.14);
  t = clamp(t, 0.0, 1.0) * 3.0;
  return t < 1.0 ? mix(a, b, t) : t < 2.0 ? mix(b, c, t - 1.0) : mix(c, d, t - 2.0);
}
void main() {
  vec2 row = texelFetch(angles, ivec2(gl_VertexID / columns, 0), 0).rg;
  float elevation = row.x, azimuth = row.y + float(gl_VertexID % columns) * azimuthStep;
  float range = steps * rangeStep;
  vec3 beam = vec3(cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation));
  vec3 local = range * beam;
  vHeight = local.z + height;
  vColor = paintsRange ? ramp(range / farthest) : vec3(0.15 + 0.85 * intensity);
  vec4 seen = modelViewMatrix * vec4(local, 1.0);
  gl_Position = steps > 0.0 ? projectionMatrix * seen : vec4(2.0, 2.0, 2.0, 1.0);
  gl_PointSize = pixelRatio * clamp(22.0 / -seen.z, 1.5, 4.0);
}
`;
const FRAGMENT = /* glsl */ `
precision highp float;
uniform vec2 slice;
in float vHeight;
in vec3 vColor;
out vec4 fragColor;
void main() {
  if (vHeight < slice.x || vHeight > slice.y) discard;
  fragColor = vec4(vColor, 1.0);
}
`;

export class CloudPoints {
  readonly points: Points<BufferGeometry, ShaderMaterial>;
  private readonly angles: DataTexture;

  constructor(
    cloud: Cloud,
    private readonly station: StageStation,
    farthestM: number,
  ) {
    const geometry = new BufferGeometry();
    geometry.setAttribute('steps', new BufferAttribute(cloud.rangeSteps, 1));
    geometry.setAttribute('intensity', new BufferAttribute(cloud.intensity, 1, true));
    geometry.setDrawRange(0, cloud.rangeSteps.length);
    const angles = new Float32Array(2 * station.cloudRows);
    for (let row = 0; row < station.cloudRows; row++) {
      angles[2 * row] = station.elevationsRad[row];
      angles[2 * row + 1] = station.azimuthsRad[row];
    }
    this.angles = new DataTexture(angles, station.cloudRows, 1, RGFormat, FloatType);
    this.angles.internalFormat = 'RG32F';
    this.angles.minFilter = this.angles.magFilter = NearestFilter;
    this.angles.needsUpdate = true;
    const material = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: {
        angles: { value: this.angles },
        columns: { value: station.cloudColumns },
        azimuthStep: { value: station.azimuthStepRad },
        rangeStep: { value: station.rangeStepM },
        farthest: { value: farthestM },
        pixelRatio: { value: Math.min(2, window.devicePixelRatio) },
        height: { value: station.positionM[2] },
        paintsRange: { value: true },
        slice: { value: [-1e9, 1e9] },
      },
    });
    this.points = new Points(geometry, material);
    // Its positions are known to the shader only.
    this.points.frustumCulled = false;
  }

  setSlice(slice: Slice | undefined): void {
    this.points.visible = slice !== undefined;
    if (slice === undefined) return;
    const [x, y, z] = this.station.positionM;
    this.points.position.set(x, y, z + slice.liftM);
    this.points.material.uniforms.slice.value = [Math.max(-1e9, slice.bottomM), Math.min(1e9, slice.topM)];
  }

  setPaint(paint: CloudPaint): void {
    this.points.material.uniforms.paintsRange.value = paint === 'range';
  }

  dispose(): void {
    this.points.geometry.dispose();
    this.points.material.dispose();
    this.angles.dispose();
  }
}
