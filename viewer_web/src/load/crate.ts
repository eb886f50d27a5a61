/**
 * USD crate files (.usdc): prims and the values of their attributes, nothing composed.
 *
 * Our own small reader and not three's USDLoader: that one drops primvars and custom attributes, reads int -1 as
 * 4294967295 and is slow with many prims. It reads what `docs/formats/stage.md` allows in viewer/stage.usdc: scalars, strings,
 * vectors, matrix4d and arrays of int, float and their vectors. A value is decoded when it is asked for.
 *
 * Layout, as OpenUSD's pxr/usd/sdf/crateFile.h describes it: a head with the place of the table of contents; sections TOKENS,
 * STRINGS, FIELDS (name, value), FIELDSETS (runs of fields, ended by -1), PATHS (a tree in depth-first order) and SPECS
 * (path, field set, kind). A value is 64 bits: flags and type in the upper 16, in the lower 48 the value itself or its place.
 */
import { decompressChunks } from './lz4.ts';
import { PlanLoadError } from './plan-load-error.ts';

export type CrateValue = number | string | Float32Array | Float64Array | Int32Array;

export interface CratePrim {
  readonly path: string;
  readonly typeName: string;
  /** The value of an attribute; undefined where the prim has no such attribute or it has no value. */
  get(attribute: string): CrateValue | undefined;
}

/** Numbers of SdfSpecType and of the crate's value types, as the files hold them. */
const SPEC_ATTRIBUTE = 1;
const SPEC_PRIM = 6;
const TYPE = {
  bool: 1,
  int: 3,
  uint: 4,
  float: 8,
  double: 9,
  string: 10,
  token: 11,
  matrix4d: 15,
  double3: 23,
  float3: 24,
  specifier: 42,
} as const;
const COMPONENTS = new Map<number, number>([
  [TYPE.matrix4d, 16],
  [TYPE.double3, 3],
  [TYPE.float3, 3],
  [20, 2], // float2
]);
/** Shorter arrays are stored as they are even where the flag says compressed. */
const SHORTEST_COMPRESSED_ARRAY = 16;
const OLDEST_VERSION = 0x000700; // 0.7.0: array sizes in 64 bits

/** Read all prims of a crate file, in the order of the file. */
export function readCrate(buffer: ArrayBuffer): CratePrim[] {
  return new CrateReader(buffer).prims();
}

class CrateReader {
  private readonly view: DataView;
  private readonly bytes: Uint8Array;
  private at = 0;
  private readonly sections = new Map<string, number>();
  private readonly tokens: string[];
  private readonly strings: Uint32Array;
  private readonly fieldNames: Int32Array;
  private readonly fieldValues: DataView;
  private readonly fieldSets: Int32Array;

  constructor(buffer: ArrayBuffer) {
    this.view = new DataView(buffer);
    this.bytes = new Uint8Array(buffer);
    this.readContents();
    this.tokens = this.readTokens();
    this.strings = this.readStrings();
    this.seek('FIELDS');
    const nFields = this.size();
    this.fieldNames = this.integers(nFields);
    const values = this.packedBytes(nFields * 8);
    this.fieldValues = new DataView(values.buffer, values.byteOffset, values.byteLength);
    this.seek('FIELDSETS');
    this.fieldSets = this.integers(this.size());
  }

  prims(): CratePrim[] {
    const paths = this.readPaths();
    this.seek('SPECS');
    const nSpecs = this.size();
    const specPath = this.integers(nSpecs);
    const specFields = this.integers(nSpecs);
    const specKind = this.integers(nSpecs);
    const prims = new Map<number, Prim>();
    for (let i = 0; i < nSpecs; i++) {
      if (specKind[i] !== SPEC_PRIM) continue;
      prims.set(specPath[i], new Prim(paths.name[specPath[i]], this.typeName(specFields[i]), this));
    }
    for (let i = 0; i < nSpecs; i++) {
      if (specKind[i] !== SPEC_ATTRIBUTE) continue;
      const owner = prims.get(paths.owner[specPath[i]]);
      const field = this.fieldOf(specFields[i], 'default');
      if (owner !== undefined && field >= 0) owner.fields.set(paths.name[specPath[i]], field);
    }
    return [...prims.values()];
  }

  /** The decoded value of a field; `what` names it in errors. */
  value(field: number, what: string): CrateValue {
    const low = this.fieldValues.getUint32(field * 8, true);
    const high = this.fieldValues.getUint32(field * 8 + 4, true);
    const type = (high >>> 16) & 0xff;
    const place = low + (high & 0xffff) * 0x1_0000_0000;
    const isArray = high >>> 31 === 1;
    const isInlined = ((high >>> 30) & 1) === 1;
    const isCompressed = ((high >>> 29) & 1) === 1;
    if (isArray) return this.array(type, place, isCompressed, what);
    return isInlined ? this.inlined(type, low, what) : this.stored(type, place, what);
  }

  private inlined(type: number, low: number, what: string): CrateValue {
    const word = new DataView(new ArrayBuffer(4));
    word.setUint32(0, low, true);
    switch (type) {
      case TYPE.int:
        return low | 0;
      case TYPE.bool:
      case TYPE.uint:
      case TYPE.specifier:
        return low;
      case TYPE.float:
      case TYPE.double: // doubles that a float holds exactly
        return word.getFloat32(0, true);
      case TYPE.token:
        return this.tokens[low];
      case TYPE.string:
        return this.tokens[this.strings[low]];
      case TYPE.double3:
      case TYPE.float3:
        return Float64Array.of(word.getInt8(0), word.getInt8(1), word.getInt8(2));
      case TYPE.matrix4d: {
        const matrix = new Float64Array(16);
        for (let i = 0; i < 4; i++) matrix[i * 5] = word.getInt8(i);
        return matrix;
      }
      default:
        throw unsupported(what, type);
    }
  }

  private stored(type: number, place: number, what: string): CrateValue {
    if (type === TYPE.double) return this.view.getFloat64(place, true);
    const n = COMPONENTS.get(type);
    if (n === undefined) throw unsupported(what, type);
    const isFloat32 = type === TYPE.float3 || type === 20;
    const out = new Float64Array(n);
    for (let i = 0; i < n; i++) {
      out[i] = isFloat32 ? this.view.getFloat32(place + i * 4, true) : this.view.getFloat64(place + i * 8, true);
    }
    return out;
  }

  private array(type: number, place: number, isCompressed: boolean, what: string): CrateValue {
    const isInt = type === TYPE.int;
    const n = type === TYPE.float || isInt ? 1 : type === TYPE.float3 ? 3 : type === 20 ? 2 : 0;
    if (n === 0) throw unsupported(`${what}[]`, type);
    if (place === 0) return isInt ? new Int32Array(0) : new Float32Array(0);
    this.at = place;
    const length = this.size();
    if (isCompressed && length >= SHORTEST_COMPRESSED_ARRAY) {
      return isInt ? this.integers(length) : this.compressedFloats(length, what);
    }
    const raw = this.slice(length * n * 4);
    return isInt ? new Int32Array(raw) : new Float32Array(raw);
  }

  /** Floats that are all whole numbers ('i'), or few different ones ('t': a table and indices). */
  private compressedFloats(length: number, what: string): Float32Array {
    const code = String.fromCharCode(this.bytes[this.at++]);
    if (code === 'i') return Float32Array.from(this.integers(length));
    if (code !== 't') throw unsupported(`${what} (float coding ${code})`, TYPE.float);
    const tableLength = this.view.getUint32(this.at, true);
    this.at += 4;
    const table = new Float32Array(this.slice(tableLength * 4));
    return Float32Array.from(this.integers(length), (index) => table[index]);
  }

  private readContents(): void {
    const isCrate = this.bytes.length > 88 && String.fromCharCode(...this.bytes.subarray(0, 8)) === 'PXR-USDC';
    if (!isCrate) throw damaged('it does not begin like a USD crate file');
    const [major, minor, patch] = this.bytes.subarray(8, 11);
    if ((major << 16) + (minor << 8) + patch < OLDEST_VERSION) {
      throw damaged(`it has crate version ${major}.${minor}.${patch}, expected 0.7.0 or later`);
    }
    this.at = 16;
    this.at = this.size();
    for (let n = this.size(); n > 0; n--) {
      const name = text(this.bytes.subarray(this.at, this.at + 16)).replace(/\0.*$/s, '');
      this.at += 16;
      this.sections.set(name, this.size());
      this.size();
    }
  }

  private readTokens(): string[] {
    this.seek('TOKENS');
    const nTokens = this.size();
    const tokens = text(this.packedBytes(this.size())).split('\0');
    if (tokens.length < nTokens) throw damaged('its table of names is too short');
    return tokens;
  }

  private readStrings(): Uint32Array {
    this.seek('STRINGS');
    return new Uint32Array(this.slice(this.size() * 4));
  }

  /** The tree of paths: for a prim its full path, for a property its name and the path number of its owner. */
  private readPaths(): { name: string[]; owner: Int32Array } {
    this.seek('PATHS');
    const nPaths = this.size();
    const n = this.size();
    const pathOf = this.integers(n);
    const elementOf = this.integers(n);
    const jumpOf = this.integers(n);
    const name: string[] = new Array(nPaths).fill('');
    const owner = new Int32Array(nPaths).fill(-1);
    // Siblings still to be read: (entry, parent path number).
    const open: [number, number][] = n > 0 ? [[0, -1]] : [];
    while (open.length > 0) {
      let [entry, parent] = open.pop() as [number, number];
      for (;;) {
        const path = pathOf[entry];
        const element = elementOf[entry];
        const jump = jumpOf[entry];
        owner[path] = parent;
        if (parent >= 0) {
          const token = this.tokens[Math.abs(element)];
          name[path] = element < 0 ? token : `${name[parent]}/${token}`;
        }
        const hasChild = jump > 0 || jump === -1;
        const hasSibling = jump >= 0;
        if (hasChild && hasSibling) open.push([entry + jump, parent]);
        if (hasChild) parent = path;
        else if (!hasSibling) break;
        entry++;
      }
    }
    return { name, owner };
  }

  private typeName(fieldSet: number): string {
    const field = this.fieldOf(fieldSet, 'typeName');
    return field < 0 ? '' : String(this.value(field, 'typeName'));
  }

  private fieldOf(fieldSet: number, fieldName: string): number {
    for (let i = fieldSet; this.fieldSets[i] >= 0; i++) {
      if (this.tokens[this.fieldNames[this.fieldSets[i]]] === fieldName) return this.fieldSets[i];
    }
    return -1;
  }

  private seek(section: string): void {
    const place = this.sections.get(section);
    if (place === undefined) throw damaged(`it has no section ${section}`);
    this.at = place;
  }

  /** A 64-bit count or place; files beyond 2^53 bytes do not exist. */
  private size(): number {
    if (this.at + 8 > this.bytes.length) throw damaged('it ends too early');
    const size = this.view.getUint32(this.at, true) + this.view.getUint32(this.at + 4, true) * 0x1_0000_0000;
    this.at += 8;
    return size;
  }

  private slice(nBytes: number): ArrayBuffer {
    if (this.at + nBytes > this.bytes.length) throw damaged('it ends too early');
    this.at += nBytes;
    // A copy: places in the file are not aligned.
    return this.bytes.slice(this.at - nBytes, this.at).buffer as ArrayBuffer;
  }

  private packedBytes(unpackedBytes: number): Uint8Array {
    const packed = this.size();
    if (this.at + packed > this.bytes.length) throw damaged('it ends too early');
    this.at += packed;
    return decompressChunks(this.bytes.subarray(this.at - packed, this.at), unpackedBytes);
  }

  /** Integers as differences: a 2-bit code each (the most common difference, or 1, 2, 4 bytes), then those bytes. */
  private integers(n: number): Int32Array {
    const out = new Int32Array(n);
    if (n === 0) {
      if (this.at + 8 <= this.bytes.length) this.at += 8 + this.view.getUint32(this.at, true);
      return out;
    }
    const nCodeBytes = Math.ceil(n / 4);
    const packed = this.packedBytes(4 + nCodeBytes + 4 * n);
    const view = new DataView(packed.buffer, packed.byteOffset, packed.byteLength);
    const common = view.getInt32(0, true);
    let from = 4 + nCodeBytes;
    let value = 0;
    for (let i = 0; i < n; i++) {
      const code = (packed[4 + (i >> 2)] >> ((i & 3) * 2)) & 3;
      if (code === 0) value += common;
      else if (code === 1) value += view.getInt8(from);
      else if (code === 2) value += view.getInt16(from, true);
      else value += view.getInt32(from, true);
      from += code === 3 ? 4 : code;
      value |= 0;
      out[i] = value;
    }
    return out;
  }
}

class Prim implements CratePrim {
  readonly fields = new Map<string, number>();

  constructor(
    readonly path: string,
    readonly typeName: string,
    private readonly reader: CrateReader,
  ) {}

  get(attribute: string): CrateValue | undefined {
    const field = this.fields.get(attribute);
    return field === undefined ? undefined : this.reader.value(field, `${this.path}.${attribute}`);
  }
}

function text(bytes: Uint8Array): string {
  return new TextDecoder().decode(bytes);
}

function damaged(why: string): PlanLoadError {
  return new PlanLoadError(`viewer/stage.usdc can't be read: ${why}. Write the plan again with \`tlsplan plan\`.`);
}

function unsupported(what: string, type: number): PlanLoadError {
  return damaged(`${what} has the value type ${type}, which the viewer does not read`);
}
