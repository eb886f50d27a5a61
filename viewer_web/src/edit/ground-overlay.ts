/** Where a tripod may stand, tinted on the floor while a station is on its way. */
import { DataTexture, DoubleSide, Mesh, MeshBasicMaterial, NearestFilter, PlaneGeometry, RGBAFormat } from 'three';
import { GROUND, type GroundMap } from './ground-map.ts';

/** Red, green, blue, opacity. */
const ADMISSIBLE = [46, 158, 91, 90] as const;
const KEPT_OUT = [194, 69, 58, 90] as const;
const ABOVE_M = 0.02;

export class GroundOverlay {
  readonly mesh: Mesh<PlaneGeometry, MeshBasicMaterial>;
  private readonly texture: DataTexture;

  /** `groundM`: the floor's height as drawn; `offsetM`: scene = local + offset. */
  constructor({ head, values }: GroundMap, groundM: number, offsetM: readonly [number, number, number]) {
    const colours = new Uint8Array(4 * head.width * head.height);
    for (let i = 0; i < head.width * head.height; i++) {
      if (values[i] === GROUND.admissible) colours.set(ADMISSIBLE, 4 * i);
      else if (values[i] === GROUND.keptOut) colours.set(KEPT_OUT, 4 * i);
    }
    this.texture = new DataTexture(colours, head.width, head.height, RGBAFormat);
    this.texture.minFilter = this.texture.magFilter = NearestFilter;
    this.texture.needsUpdate = true;
    const [widthM, depthM] = [head.width * head.cell_m, head.height * head.cell_m];
    const look = { map: this.texture, transparent: true, depthWrite: false, side: DoubleSide };
    this.mesh = new Mesh(new PlaneGeometry(widthM, depthM), new MeshBasicMaterial(look));
    const [x, y] = [head.origin[0] - offsetM[0] + widthM / 2, head.origin[1] - offsetM[1] + depthM / 2];
    this.mesh.position.set(x, y, groundM + ABOVE_M);
  }

  dispose(): void {
    this.texture.dispose();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}
