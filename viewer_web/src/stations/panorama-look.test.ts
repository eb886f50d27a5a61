import { PerspectiveCamera, Vector3 } from 'three';
import { expect, test } from 'vitest';
import type { PanoramaFrame } from './panorama-image.ts';
import { directionAt } from './panorama-image.ts';
import { directionIn, firstLook, type Look, lookPixels, placeIn, turned } from './panorama-look.ts';

const SIZE = { width: 96, height: 54 };
const LOOKS: Look[] = [0, 0.7, 3, -2.4].flatMap((azimuthRad) =>
  [-1.2, 0, 0.5].map((elevationRad) => ({ azimuthRad, elevationRad, fieldOfViewRad: 1.4 })),
);
const FRAME: PanoramaFrame = {
  ...{ width: 720, height: 360, leftRad: 1, spanRad: 2 * Math.PI },
  ...{ topRad: Math.PI / 2, bottomRad: -Math.PI / 2 },
};

const vectorOf = (azimuthRad: number, elevationRad: number): Vector3 =>
  new Vector3(
    Math.cos(elevationRad) * Math.cos(azimuthRad),
    Math.cos(elevationRad) * Math.sin(azimuthRad),
    Math.sin(elevationRad),
  );

/** A camera of the 3D picture that looks the same way. */
function cameraOf({ azimuthRad, elevationRad, fieldOfViewRad }: Look): PerspectiveCamera {
  const aspect = SIZE.width / SIZE.height;
  const upright = 2 * Math.atan(Math.tan(fieldOfViewRad / 2) / aspect);
  const camera = new PerspectiveCamera((upright * 180) / Math.PI, aspect, 0.1, 100);
  camera.up.set(0, 0, 1);
  camera.lookAt(vectorOf(azimuthRad, elevationRad));
  camera.updateMatrixWorld();
  return camera;
}

test.each(LOOKS)('places and directions are those of a camera that looks the same way: %o', (look) => {
  const camera = cameraOf(look);
  for (const [x, y] of [
    [1, 1],
    [48, 27],
    [95, 3],
    [20, 50],
  ]) {
    const ray = new Vector3((2 * x) / SIZE.width - 1, 1 - (2 * y) / SIZE.height, 0.5).unproject(camera).normalize();
    const { azimuthRad, elevationRad } = directionIn(look, SIZE, x, y);
    expect(vectorOf(azimuthRad, elevationRad).distanceTo(ray)).toBeLessThan(1e-9);
    const place = placeIn(look, SIZE, [4 * ray.x, 4 * ray.y, 4 * ray.z]);
    expect(Math.hypot(place!.x - x, place!.y - y)).toBeLessThan(1e-6);
  }
  const behind = vectorOf(look.azimuthRad, look.elevationRad).negate();
  expect(placeIn(look, SIZE, [behind.x, behind.y, behind.z])).toBeNull();
});

test('each pixel is that of the panorama in its direction, and none lies beyond what was scanned', () => {
  const panorama = new Uint8ClampedArray(4 * FRAME.width * FRAME.height);
  for (let i = 0; i < FRAME.width * FRAME.height; i++) {
    panorama.set([i % 256, Math.floor(i / 256) % 256, Math.floor(i / 65536), 255], 4 * i);
  }
  const bounded = { ...FRAME, height: 300, bottomRad: FRAME.topRad - (300 / 360) * Math.PI };
  for (const [frame, look] of LOOKS.map((each, n) => [n % 2 ? FRAME : bounded, each] as const)) {
    const pixels = lookPixels(panorama, frame, look, SIZE);
    let n = 0;
    for (let y = 0; y < SIZE.height; y += 3) {
      for (let x = 0; x < SIZE.width; x += 3) {
        const to = directionIn(look, SIZE, x + 0.5, y + 0.5);
        const at = 4 * (y * SIZE.width + x);
        if (to.elevationRad < frame.bottomRad) {
          expect(pixels[at + 3]).toBe(0);
          continue;
        }
        const i = pixels[at] + 256 * pixels[at + 1] + 65536 * pixels[at + 2];
        const of = directionAt(frame, i % FRAME.width, Math.floor(i / FRAME.width));
        const offRad = vectorOf(of.azimuthRad, of.elevationRad).angleTo(vectorOf(to.azimuthRad, to.elevationRad));
        expect(offRad).toBeLessThan(0.75 * (Math.PI / 360));
        n += 1;
      }
    }
    expect(n).toBeGreaterThan(100);
  }
});

test('one turns all around, neither over the zenith nor through it, and gets neither too near nor too far', () => {
  const look: Look = { azimuthRad: 0, elevationRad: 0, fieldOfViewRad: 1.4 };
  expect(turned(look, 7, 0).azimuthRad).toBe(7);
  expect(turned(look, 0, 9).elevationRad).toBeLessThan(Math.PI / 2);
  expect(turned(look, 0, -9).elevationRad).toBeGreaterThan(-Math.PI / 2);
  expect(turned(look, 0, 0, 0.01).fieldOfViewRad).toBeCloseTo(Math.PI / 6);
  expect(turned(look, 0, 0, 100).fieldOfViewRad).toBeCloseTo((2 * Math.PI) / 3);
});

test('the first look is level, or in the middle of a low field of view, and goes where the view is longest', () => {
  const longest = 2.2;
  const rangeM = ({ azimuthRad }: { azimuthRad: number }): number => 10 + Math.cos(azimuthRad - longest);
  const off = (angle: number): number => Math.abs(Math.atan2(Math.sin(angle - longest), Math.cos(angle - longest)));
  const look = firstLook(FRAME, rangeM);
  expect(look.elevationRad).toBe(0);
  expect(off(look.azimuthRad)).toBeLessThan(0.05);
  const low = firstLook({ ...FRAME, topRad: 0.035, bottomRad: -0.43 }, rangeM);
  expect(low.elevationRad).toBeCloseTo(-0.2, 2);
  expect(off(low.azimuthRad)).toBeLessThan(0.05);
});
