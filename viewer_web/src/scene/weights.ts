/** Barycentric weights of a point on a merged triangle, for the patch under a pick. */

export function weightsAt(
  cornersM: Float32Array,
  triangle: number,
  point: { readonly x: number; readonly y: number; readonly z: number },
): [number, number, number] {
  const i = 9 * triangle;
  const minus = (a: number, b: number): [number, number, number] => [
    cornersM[a] - cornersM[b],
    cornersM[a + 1] - cornersM[b + 1],
    cornersM[a + 2] - cornersM[b + 2],
  ];
  const dot = (u: readonly number[], v: readonly number[]): number => u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  const [e, f] = [minus(i + 3, i), minus(i + 6, i)];
  const at = [point.x - cornersM[i], point.y - cornersM[i + 1], point.z - cornersM[i + 2]];
  const [ee, ef, ff, ea, fa] = [dot(e, e), dot(e, f), dot(f, f), dot(e, at), dot(f, at)];
  const area2 = ee * ff - ef * ef;
  const [w1, w2] = [(ff * ea - ef * fa) / area2, (ee * fa - ef * ea) / area2];
  return [1 - w1 - w2, w1, w2];
}
