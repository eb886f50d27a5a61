/**
 * The stage viewer/stage.usdc as the viewer holds it: one merged triangle list, floors, stations (docs/formats/stage.md).
 *
 * Everything is in the local frame, metres, z up. Triangle corners keep the order of the file: patches are
 * addressed by it.
 */
import { type CratePrim, type CrateValue, readCrate } from './crate.ts';
import { squaredEdges } from './patch-rule.ts';
import { PlanLoadError } from './plan-load-error.ts';

export interface StageElement {
  /** Index in the scene's list of elements, as plan.json names it. */
  readonly sceneIndex: number;
  readonly name: string;
  readonly kind: string;
  /** What finds it again in the source: of IFC its GlobalId. */
  readonly sourceId: string;
  readonly floorId: string;
  /** Number of its file in `Stage.files`; 0 of a scene of one file. */
  readonly file: number;
  /** Its triangles are firstTriangle ... firstTriangle + nTriangles - 1 of the merged list. */
  readonly firstTriangle: number;
  readonly nTriangles: number;
}

export interface StageFloor {
  readonly id: string;
  readonly name: string;
  readonly index: number;
  readonly elevationM: number;
  readonly topM: number;
  readonly groundAreaM2: number;
}

export interface StageStation {
  readonly id: string;
  readonly floorId: string;
  readonly order: number;
  readonly positionM: readonly [number, number, number];
  readonly cloudUri: string;
  readonly cloudRows: number;
  readonly cloudColumns: number;
  readonly rangeStepM: number;
  /** One a row. */
  readonly elevationsRad: Float32Array;
  /** Of each row's first beam; the next column is `azimuthStepRad` on. */
  readonly azimuthsRad: Float32Array;
  readonly azimuthStepRad: number;
}

/** Triangle by triangle; (T, 9), (T, 3) and (T,) flat arrays. */
export interface StageTriangles {
  readonly count: number;
  readonly cornersM: Float32Array;
  readonly squaredEdgesM2: Float32Array;
  readonly element: Int32Array;
  readonly firstPatch: Int32Array;
  readonly patchDepth: Uint8Array;
  /** Floor whose ground the triangle is, plus 1; 0: not ground. */
  readonly groundOf: Uint8Array;
}

export interface Stage {
  readonly triangles: StageTriangles;
  readonly elements: readonly StageElement[];
  /** Names of the files, in the order given; empty: the scene is one file. */
  readonly files: readonly string[];
  /** Lowest first. */
  readonly floors: readonly StageFloor[];
  readonly stations: readonly StageStation[];
  /** scene = local + offset. */
  readonly offsetM: readonly [number, number, number];
}

/** Read the bytes of viewer/stage.usdc. */
export function readStage(buffer: ArrayBuffer): Stage {
  const prims = readCrate(buffer);
  const plan = prims.find((prim) => prim.path === '/Plan');
  if (plan === undefined) throw damaged('it has no prim /Plan');
  const meshes = prims.filter((prim) => prim.typeName === 'Mesh' && prim.path.startsWith('/Plan/Building/'));
  if (meshes.length === 0) throw damaged('it has no meshes under /Plan/Building');
  const children = (folder: string): CratePrim[] =>
    prims.filter((prim) => prim.path.startsWith(folder) && !prim.path.slice(folder.length).includes('/'));
  const files = children('/Plan/Building/').filter((prim) => prim.get('tlsplan:file') !== undefined);
  return {
    ...mergeMeshes(
      meshes,
      files.map(({ path }) => `${path}/`),
    ),
    files: files.map((prim) => string(prim, 'tlsplan:file')),
    floors: children('/Plan/Floors/')
      .map(readFloor)
      .sort((a, b) => a.index - b.index),
    stations: children('/Plan/Stations/')
      .map(readStation)
      .sort((a, b) => a.order - b.order),
    offsetM: [number(plan, 'tlsplan:offsetX'), number(plan, 'tlsplan:offsetY'), number(plan, 'tlsplan:offsetZ')],
  };
}

/** `folders`: paths that the meshes of each file are below. */
function mergeMeshes(
  meshes: readonly CratePrim[],
  folders: readonly string[],
): { triangles: StageTriangles; elements: StageElement[] } {
  const indices = meshes.map((mesh) => integers(mesh, 'faceVertexIndices'));
  const count = indices.reduce((sum, list) => sum + list.length / 3, 0);
  const triangles = {
    count,
    cornersM: new Float32Array(9 * count),
    squaredEdgesM2: new Float32Array(3 * count),
    element: new Int32Array(count),
    firstPatch: new Int32Array(count),
    patchDepth: new Uint8Array(count),
    groundOf: new Uint8Array(count),
  };
  const elements: StageElement[] = [];
  let first = 0;
  meshes.forEach((mesh, element) => {
    const n = indices[element].length / 3;
    if (integers(mesh, 'faceVertexCounts').some((corners) => corners !== 3)) {
      throw damaged(`${mesh.path} has faces that are not triangles`);
    }
    copyCorners(mesh, indices[element], triangles.cornersM.subarray(9 * first, 9 * (first + n)));
    triangles.element.fill(element, first, first + n);
    triangles.firstPatch.set(perFace(mesh, 'primvars:tlsplan:firstPatch', n), first);
    triangles.patchDepth.set(perFace(mesh, 'primvars:tlsplan:patchDepth', n), first);
    triangles.groundOf.set(perFace(mesh, 'primvars:tlsplan:floorIndex', n), first);
    for (let t = first; t < first + n; t++) {
      triangles.squaredEdgesM2.set(squaredEdges(triangles.cornersM, 9 * t), 3 * t);
    }
    elements.push({
      sceneIndex: number(mesh, 'tlsplan:element'),
      name: string(mesh, 'tlsplan:name'),
      kind: string(mesh, 'tlsplan:kind'),
      sourceId: string(mesh, 'tlsplan:sourceId'),
      floorId: string(mesh, 'tlsplan:floor'),
      file: Math.max(
        0,
        folders.findIndex((folder) => mesh.path.startsWith(folder)),
      ),
      firstTriangle: first,
      nTriangles: n,
    });
    first += n;
  });
  return { triangles, elements };
}

function copyCorners(mesh: CratePrim, indices: Int32Array, to: Float32Array): void {
  const points = floats(mesh, 'points');
  const matrix = mesh.get('xformOp:transform');
  const m = matrix instanceof Float64Array && !isIdentity(matrix) ? matrix : null;
  for (let i = 0; i < indices.length; i++) {
    const at = 3 * indices[i];
    if (!(at >= 0 && at + 2 < points.length)) throw damaged(`${mesh.path} names a point that does not exist`);
    const [x, y, z] = [points[at], points[at + 1], points[at + 2]];
    // USD multiplies row vectors: the translation is the last row.
    for (let k = 0; k < 3; k++) to[3 * i + k] = m ? x * m[k] + y * m[4 + k] + z * m[8 + k] + m[12 + k] : points[at + k];
  }
}

function isIdentity(matrix: Float64Array): boolean {
  return matrix.every((value, i) => value === (i % 5 === 0 ? 1 : 0));
}

function readFloor(prim: CratePrim): StageFloor {
  return {
    id: string(prim, 'tlsplan:floorId'),
    name: string(prim, 'tlsplan:name'),
    index: number(prim, 'tlsplan:index'),
    elevationM: number(prim, 'tlsplan:elevation'),
    topM: number(prim, 'tlsplan:top'),
    groundAreaM2: number(prim, 'tlsplan:groundArea'),
  };
}

function readStation(prim: CratePrim): StageStation {
  const matrix = prim.get('xformOp:transform');
  if (!(matrix instanceof Float64Array)) throw damaged(`${prim.path} has no xformOp:transform`);
  const cloudColumns = number(prim, 'tlsplan:cloudColumns');
  const elevationsRad = floats(prim, 'tlsplan:elevations');
  // Stages written before there were sectors and offsets say nothing of azimuths: a full turn from 0.
  const hasAzimuths = prim.get('tlsplan:azimuthStep') !== undefined;
  return {
    id: string(prim, 'tlsplan:stationId'),
    floorId: string(prim, 'tlsplan:floorId'),
    order: number(prim, 'tlsplan:order'),
    positionM: [matrix[12], matrix[13], matrix[14]],
    cloudUri: string(prim, 'tlsplan:cloudUri'),
    cloudRows: number(prim, 'tlsplan:cloudRows'),
    cloudColumns,
    rangeStepM: number(prim, 'tlsplan:rangeStep'),
    elevationsRad,
    azimuthsRad: hasAzimuths ? floats(prim, 'tlsplan:azimuths') : new Float32Array(elevationsRad.length),
    azimuthStepRad: hasAzimuths ? number(prim, 'tlsplan:azimuthStep') : (2 * Math.PI) / cloudColumns,
  };
}

function need<T extends CrateValue>(prim: CratePrim, attribute: string, is: (value: unknown) => value is T): T {
  const value = prim.get(attribute);
  if (!is(value)) throw damaged(`${prim.path} has no fitting ${attribute}`);
  return value;
}

const number = (prim: CratePrim, attribute: string): number =>
  need(prim, attribute, (value): value is number => typeof value === 'number');
const string = (prim: CratePrim, attribute: string): string =>
  need(prim, attribute, (value): value is string => typeof value === 'string');
const integers = (prim: CratePrim, attribute: string): Int32Array =>
  need(prim, attribute, (value): value is Int32Array => value instanceof Int32Array);
const floats = (prim: CratePrim, attribute: string): Float32Array =>
  need(prim, attribute, (value): value is Float32Array => value instanceof Float32Array);

function perFace(mesh: CratePrim, attribute: string, nFaces: number): Int32Array {
  const values = integers(mesh, attribute);
  if (values.length !== nFaces) {
    throw damaged(`${mesh.path} has ${values.length} values of ${attribute}, expected ${nFaces}`);
  }
  return values;
}

function damaged(why: string): PlanLoadError {
  return new PlanLoadError(`viewer/stage.usdc can't be shown: ${why}. Write the plan again with \`tlsplan plan\`.`);
}
