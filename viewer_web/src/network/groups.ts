/** Groups of stations that do not register with each other: members, a colour each, and what comes nearest to joining them. */
import { t } from '../language/language.ts';
import type { NetworkJoin, PlanLink } from '../load/plan-json.ts';
import { type Counting, linkPercent, type NetworkReport } from './graph.ts';
import { lackInWords } from './link-groups.ts';

/** Dark enough for white numbers, and apart for the colour-blind; further groups begin anew. */
export const GROUP_COLORS = [
  '#1d3b47',
  '#b8480a',
  '#0b5fa5',
  '#8f2f77',
  '#0a7a55',
  '#7a5b00',
  '#5b4bb0',
  '#8a1f2d',
] as const;

export interface Group {
  /** From 1, the largest first. */
  readonly number: number;
  readonly stations: readonly string[];
  /** The link to another group that comes nearest to counting; null: nothing listed is shared with one. */
  readonly nearest: PlanLink | null;
}

export function groupsOf({ components, gaps }: NetworkReport): Group[] {
  return components.map((stations, i) => {
    const ids = new Set(stations);
    return { number: i + 1, stations, nearest: gaps.find(({ a, b }) => ids.has(a) || ids.has(b)) ?? null };
  });
}

export const groupColor = (number: number): string => GROUP_COLORS[(number - 1) % GROUP_COLORS.length];

/** Why a group stands apart, by the link that comes nearest to joining it. */
export function whyApart({ nearest }: Group, counting: Counting): string {
  if (nearest === null) return t('shares no surface worth listing with another group');
  const words = { a: nearest.a, b: nearest.b, percent: linkPercent(nearest, counting) };
  return t('nearest: {a} – {b}, {percent}, {lack}', { ...words, lack: lackInWords(nearest, counting) ?? '' });
}

/** What stations that no surface needs are there for, a line each cluster of them. */
export const joinsInWords = (joins: readonly NetworkJoin[]): string =>
  joins
    .map(({ stations, n_groups: n }) =>
      n > 1
        ? t('{stations}: joins {n} groups', { stations: stations.join(' '), n })
        : t('{stations}: makes the network hold as set up', { stations: stations.join(' ') }),
    )
    .join('\n');

/** Number of the group of each station. */
export function numberByStation(groups: readonly Group[]): ReadonlyMap<string, number> {
  return new Map(groups.flatMap(({ number, stations }) => stations.map((id) => [id, number] as const)));
}
