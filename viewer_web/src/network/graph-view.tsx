/** The network as a graph: stations as they stand in plan, links coloured by strength. */
import { t } from '../language/language.ts';
import type { PlanLink } from '../load/plan-json.ts';
import type { Store } from '../store.ts';
import { countingOf, linkPercent, type NetworkReport } from './graph.ts';
import { layOut } from './graph-layout.ts';
import { groupColor } from './groups.ts';
import { lackInWords } from './link-groups.ts';
import { strengthColor, strengthInWords } from './strength.ts';

interface GraphProps {
  readonly store: Store;
  readonly report: NetworkReport;
  readonly width: number;
}

const RADIUS = 9;

export function Graph({ store, report, width }: GraphProps) {
  const floors = [...(store.loaded.value?.plan.floors ?? [])].sort((a, b) => b.elevation_m - a.elevation_m);
  const layout = layOut(
    store.shownStations.value,
    floors.map(({ id }) => id),
    { width, gap: 2 * RADIUS + 4 },
  );
  const name = (id: string): string => floors.find((floor) => floor.id === id)?.name ?? id;
  const [counting, gaps] = [report.counting, report.gaps];
  return (
    <svg
      class="graph"
      role="img"
      aria-label={t('Network of stations; the list of links below has the same content')}
      viewBox={`0 0 ${layout.width} ${layout.height}`}
    >
      {layout.floors.map(({ id, y }) => (
        <text key={id} class="graph-floor" x="2" y={y + 11}>
          {name(id)}
        </text>
      ))}
      {gaps.map((link) => (
        <Edge key={keyOf(link)} store={store} link={link} layout={layout} kind="gap" />
      ))}
      {counting.map((link) => (
        <Edge
          key={keyOf(link)}
          store={store}
          link={link}
          layout={layout}
          kind={report.bridges.has(link) ? 'bridge' : 'link'}
        />
      ))}
      {[...layout.places.values()].map(({ id, number, x, y }) => (
        // biome-ignore lint/a11y/noStaticElementInteractions: the list of stations does the same by keyboard
        <g
          key={id}
          class={store.stationId.value === id ? 'graph-node graph-node-chosen' : 'graph-node'}
          transform={`translate(${x} ${y})`}
          onClick={() => store.chooseStation(id)}
        >
          <title>
            {report.articulations.has(id) ? t('{id}: critical station, the network splits without it', { id }) : id}
          </title>
          {report.articulations.has(id) && <circle class="graph-ring" r={RADIUS + 3} />}
          <circle r={RADIUS} style={groupFill(store, id)} />
          <text y="3.5" text-anchor="middle">
            {number}
          </text>
        </g>
      ))}
    </svg>
  );
}

/** That of its group, where there are several; a chosen one has the colour of what is chosen. */
function groupFill({ groupOf, stationId }: Store, id: string): { fill?: string } {
  const group = stationId.value === id ? undefined : groupOf.value.get(id);
  return group === undefined ? {} : { fill: groupColor(group) };
}

const keyOf = ({ a, b }: PlanLink): string => `${a} ${b}`;

interface EdgeProps {
  readonly store: Store;
  readonly link: PlanLink;
  readonly layout: ReturnType<typeof layOut>;
  readonly kind: 'link' | 'bridge' | 'gap';
}

function Edge({ store, link, layout, kind }: EdgeProps) {
  const [a, b] = [layout.places.get(link.a), layout.places.get(link.b)];
  if (a === undefined || b === undefined) return null;
  const isChosen = store.pair.value?.includes(link.a) && store.pair.value.includes(link.b);
  const ends = { x1: a.x, y1: a.y, x2: b.x, y2: b.y };
  const plan = store.loaded.value?.plan;
  const lack = plan === undefined ? null : lackInWords(link, countingOf(plan));
  const what = { link: null, bridge: t('single-link connection'), gap: lack }[kind];
  const words = t('{a} – {b}: {percent}, strength {strength}', {
    a: link.a,
    b: link.b,
    percent: plan === undefined ? '' : linkPercent(link, countingOf(plan)),
    strength: strengthInWords(link.strength),
  });
  return (
    // biome-ignore lint/a11y/noStaticElementInteractions: the list of links does the same by keyboard
    <g class={`graph-edge graph-${kind}`} onClick={() => store.choosePair([link.a, link.b])}>
      <title>{what === null ? words : `${words}, ${what}`}</title>
      <line class="graph-hit" {...ends} />
      {isChosen && <line class="graph-chosen" {...ends} />}
      {kind === 'bridge' && <line class="graph-bridge-case" {...ends} />}
      <line
        {...ends}
        stroke={strengthColor(link.strength, store.isDark.value)}
        stroke-width={kind === 'gap' ? 1.2 : 1.5 + 4 * Math.min(1, link.overlap)}
        stroke-dasharray={kind === 'gap' ? '2 3' : undefined}
      />
    </g>
  );
}
