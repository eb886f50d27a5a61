/** The links as the list has them: what is missing, what all hangs on, what registers, and what does not. */
import { plain, t } from '../language/language.ts';
import type { PlanLink } from '../load/plan-json.ts';
import { askedPercent, coordinatesWords } from '../panels/figures.ts';
import { byOverlap, byStrength, type Counting, counts, type NetworkReport } from './graph.ts';

export interface LinkGroup {
  readonly title: string;
  readonly aside: string;
  /** Firmest first of those that register, as they are coloured; of the others, most overlap first. */
  readonly links: readonly PlanLink[];
  /** So many are shown at first. */
  readonly nShown: number;
}

const A_PAGE = 40;
/** Of links that are no use a few will do. */
const A_FEW = 10;

/** Every link is in one group; groups without any are left out. */
export function linkGroups(links: readonly PlanLink[], report: NetworkReport, counting: Counting): LinkGroup[] {
  const figure = counting.minProbability > 0 ? t('probability') : t('overlap');
  const gaps = new Set(report.gaps);
  const registering = new Set(report.counting);
  const groups = [
    { title: t('Missing links'), aside: t('closest to connecting groups'), links: report.gaps, nShown: A_PAGE },
    {
      title: t('Single-link connections'),
      aside: t('strength, {figure}', { figure }),
      links: byStrength([...report.bridges]),
      nShown: A_PAGE,
    },
    {
      title: t('Registration links'),
      aside: t('strength, {figure}', { figure }),
      links: byStrength(report.counting.filter((link) => !report.bridges.has(link))),
      nShown: A_PAGE,
    },
    {
      title: t('Weak links'),
      aside: t('do not register'),
      links: byOverlap(links.filter((link) => !registering.has(link) && !gaps.has(link))),
      nShown: A_FEW,
    },
  ];
  return groups.filter((group) => group.links.length > 0);
}

/** What a link lacks to count; null: it counts. */
export function lackInWords(link: PlanLink, counting: Counting): string | null {
  if (counts(link, counting)) return null;
  const [{ overlap, strength }, { threshold, minStrength, minProbability }] = [link, counting];
  if (overlap < threshold) return t('overlap below {required}', { required: askedPercent(threshold) });
  if (strength !== null && strength < minStrength) return t('strength below {least}', { least: plain(minStrength) });
  if (counts(link, { ...counting, doorsChange: false })) return t('needs an open door');
  return t('probability below {required}', { required: askedPercent(minProbability) });
}

/** Where targets hang that register a pair, in the scene's coordinates; null: none do. */
export function targetsWords({ targets = [] }: PlanLink): string | null {
  return targets.length === 0 ? null : targets.map((place) => `(${coordinatesWords(place)})`).join(' ');
}

/** Which state of doors a pair needs to register; null: either. */
export function doorsWords({ only_open: open = [], only_shut: shut = [] }: PlanLink): string | null {
  if (open.length > 0) return t('only with {n} open: {doors}', { n: open.length, doors: open.join(', ') });
  if (shut.length > 0) return t('would register with {n} shut: {doors}', { n: shut.length, doors: shut.join(', ') });
  return null;
}
