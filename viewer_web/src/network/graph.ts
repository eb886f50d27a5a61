/**
 * The network that links make of stations: its components, the links and stations it hangs on, its weakest link.
 *
 * Links count that reach the limits of `registration` in plan.json, and as set up where both stations are scanned;
 * computed here, so that drafts have it too.
 */
import { t } from '../language/language.ts';
import type { PlanJson, PlanLink } from '../load/plan-json.ts';
import { askedPercent, probabilityPercent, reachedPercent } from '../panels/figures.ts';

/** What a link needs in order to count; 0: not required. */
export interface Counting {
  /** Of overlap. */
  readonly threshold: number;
  readonly minStrength: number;
  readonly minProbability: number;
  /** Links have to hold with open doors shut, too. */
  readonly doorsChange?: boolean;
}

export type LinkFigures = Pick<PlanLink, 'overlap' | 'strength' | 'as_set_up'> & {
  readonly probability?: number | null;
  readonly only_open?: readonly string[];
  readonly targets?: readonly unknown[];
};

export interface NetworkReport {
  /** Station ids, largest component first; within a component in the order given. */
  readonly components: readonly (readonly string[])[];
  readonly counting: readonly PlanLink[];
  /** Links without which a component splits. */
  readonly bridges: ReadonlySet<PlanLink>;
  /** Stations without which the others of a component split. */
  readonly articulations: ReadonlySet<string>;
  /**
   * Of the links that some two stations can't do without on their best way to each other, the one that is nearest to
   * what is required.
   */
  readonly weakest: PlanLink | null;
  /** Between two components: the link that comes nearest to counting. */
  readonly gaps: readonly PlanLink[];
}

export function countingOf({ registration }: PlanJson): Counting {
  return {
    threshold: registration.threshold,
    minStrength: registration.min_strength ?? 0,
    minProbability: registration.min_probability ?? 0,
    doorsChange: registration.doors_change ?? false,
  };
}

/** Figures that were not computed decide nothing. */
export function counts(link: LinkFigures, counting: Counting): boolean {
  const { threshold, minStrength, minProbability, doorsChange = false } = counting;
  const { overlap, strength, as_set_up, probability = null, only_open = [], targets = [] } = link;
  const isWeak = strength !== null && strength < minStrength;
  const isRisky = probability !== null && probability < minProbability;
  const needsDoor = doorsChange && only_open.length > 0;
  return as_set_up || targets.length > 0 || (overlap >= threshold && !isWeak && !isRisky && !needsDoor);
}

/** The figure that decides whether a link counts: its probability where one is required, else its overlap. */
export function linkPercent({ overlap, probability = null }: LinkFigures, counting: Counting): string {
  return counting.minProbability > 0 && probability !== null
    ? probabilityPercent(probability, counting.minProbability)
    : reachedPercent(overlap, counting.threshold);
}

/** `, probability 99.4 %`; empty where it was not computed. */
export function registersWords({ probability = null }: LinkFigures, { minProbability }: Counting): string {
  if (probability === null) return '';
  return `, ${t('probability {percent}', { percent: probabilityPercent(probability, minProbability) })}`;
}

/** `99 % probability of registering (tracked) and 30 % overlap`; `overlap`: what the threshold is one of. */
export function needsWords({ registration }: Pick<PlanJson, 'registration'>, overlap: string): string {
  const { threshold, min_probability: probability = 0 } = registration;
  const ofOverlap = t('{required} {overlap}', { required: askedPercent(threshold), overlap });
  if (probability === 0) return ofOverlap;
  const registers = t('{required} probability of registering ({start})', {
    required: askedPercent(probability),
    start: startWords({ registration }),
  });
  return threshold > 0 ? t('{one} and {other}', { one: registers, other: ofOverlap }) : registers;
}

/** Where registration starts. */
const START_WORDS = {
  tracked: () => t('tracked'),
  manual: () => t('placed by hand'),
  level: () => t('level only'),
  none: () => t('no pre-alignment'),
} as const;

export const startWords = ({ registration }: Pick<PlanJson, 'registration'>): string =>
  START_WORDS[registration.pre_alignment ?? 'manual']();

export function networkOf(ids: readonly string[], links: readonly PlanLink[], counting: Counting): NetworkReport {
  const good = links.filter((link) => counts(link, counting));
  const near = neighbours(ids, good);
  const { components, bridges, articulations } = walk(ids, near);
  const componentOf = new Map(components.flatMap((component, i) => component.map((id) => [id, i] as const)));
  return {
    components,
    counting: good,
    bridges,
    articulations,
    weakest: weakestOf(ids, good, counting),
    gaps: gapsOf(links, componentOf, counting),
  };
}

type Neighbours = ReadonlyMap<string, readonly { readonly id: string; readonly link: PlanLink }[]>;

function neighbours(ids: readonly string[], links: readonly PlanLink[]): Neighbours {
  const near = new Map(ids.map((id) => [id, [] as { id: string; link: PlanLink }[]]));
  for (const link of links) {
    near.get(link.a)?.push({ id: link.b, link });
    near.get(link.b)?.push({ id: link.a, link });
  }
  return near;
}

interface Visit {
  readonly id: string;
  readonly by: PlanLink | null;
  next: number;
}

/** Depth first, with an own stack: numbers by entry, and the lowest number that what is below can reach (Tarjan). */
function walk(ids: readonly string[], near: Neighbours) {
  const number = new Map<string, number>();
  const lowest = new Map<string, number>();
  const bridges = new Set<PlanLink>();
  const articulations = new Set<string>();
  const components: string[][] = [];
  for (const root of ids) {
    if (number.has(root)) continue;
    const members = new Set<string>();
    const stack: Visit[] = [{ id: root, by: null, next: 0 }];
    let nRootChildren = 0;
    while (stack.length > 0) {
      const at = stack[stack.length - 1];
      if (at.next === 0) {
        number.set(at.id, number.size);
        lowest.set(at.id, number.size - 1);
        members.add(at.id);
      }
      const step = near.get(at.id)?.[at.next++];
      if (step !== undefined) {
        if (step.link === at.by) continue;
        if (number.has(step.id)) lower(lowest, at.id, number.get(step.id) ?? 0);
        else if (near.has(step.id)) stack.push({ id: step.id, by: step.link, next: 0 });
        continue;
      }
      stack.pop();
      const parent = stack[stack.length - 1];
      if (parent === undefined) continue;
      const low = lowest.get(at.id) ?? 0;
      lower(lowest, parent.id, low);
      const parentNumber = number.get(parent.id) ?? 0;
      if (low > parentNumber && at.by !== null) bridges.add(at.by);
      if (parent.id === root) nRootChildren++;
      else if (low >= parentNumber) articulations.add(parent.id);
    }
    if (nRootChildren > 1) articulations.add(root);
    components.push(ids.filter((id) => members.has(id)));
  }
  components.sort((a, b) => b.length - a.length);
  return { components, bridges, articulations };
}

function lower(lowest: Map<string, number>, id: string, value: number): void {
  lowest.set(id, Math.min(lowest.get(id) ?? value, value));
}

/** The last link that a spanning tree of greatest margins takes. */
function weakestOf(ids: readonly string[], links: readonly PlanLink[], counting: Counting): PlanLink | null {
  const parent = new Map(ids.map((id) => [id, id]));
  const find = (id: string): string => {
    let at = id;
    while (parent.get(at) !== at) {
      parent.set(at, parent.get(parent.get(at) ?? at) ?? at);
      at = parent.get(at) ?? at;
    }
    return at;
  };
  let weakest: PlanLink | null = null;
  for (const link of byMargin(links, counting)) {
    if (!parent.has(link.a) || !parent.has(link.b)) continue;
    const [a, b] = [find(link.a), find(link.b)];
    if (a === b) continue;
    parent.set(a, b);
    weakest = link;
  }
  return weakest;
}

function gapsOf(links: readonly PlanLink[], componentOf: ReadonlyMap<string, number>, counting: Counting): PlanLink[] {
  const best = new Map<string, PlanLink>();
  for (const link of byMargin(links, counting)) {
    const [a, b] = [componentOf.get(link.a), componentOf.get(link.b)];
    if (a === undefined || b === undefined || a === b) continue;
    const key = a < b ? `${a} ${b}` : `${b} ${a}`;
    if (!best.has(key)) best.set(key, link);
  }
  return byMargin([...best.values()], counting);
}

/** Farthest above what is required first; equals by overlap, then strength. */
function byMargin(links: readonly PlanLink[], counting: Counting): PlanLink[] {
  const { threshold, minStrength, minProbability } = counting;
  // The least of the multiples of what is required, of the risk for a probability; what is unknown decides nothing.
  const margin = ({ overlap, strength, probability = null, targets = [] }: PlanLink): number =>
    targets.length > 0
      ? Number.POSITIVE_INFINITY
      : Math.min(
          threshold > 0 ? overlap / threshold : Number.POSITIVE_INFINITY,
          minStrength > 0 && strength !== null ? strength / minStrength : Number.POSITIVE_INFINITY,
          minProbability > 0 && probability !== null
            ? (1 - minProbability) / (1 - probability)
            : Number.POSITIVE_INFINITY,
        );
  return byOverlap(links).sort((x, y) => {
    const [ofX, ofY] = [margin(x), margin(y)];
    return (ofX === ofY ? 0 : ofY - ofX) || y.overlap - x.overlap || (y.strength ?? 0) - (x.strength ?? 0);
  });
}

/** Firmest first, as links are coloured; by overlap, where the strength of one is not known. */
export function byStrength(links: readonly PlanLink[]): PlanLink[] {
  const inOrder = byOverlap(links);
  const isKnown = inOrder.every(({ strength }) => strength !== null);
  return isKnown ? inOrder.sort((x, y) => (y.strength ?? 0) - (x.strength ?? 0)) : inOrder;
}

/** Most first; names decide between equals, so that nothing depends on the order of the file. */
export function byOverlap(links: readonly PlanLink[]): PlanLink[] {
  return [...links].sort((x, y) => y.overlap - x.overlap || x.a.localeCompare(y.a) || x.b.localeCompare(y.b));
}
