/** Stations that would hide one another on a map: at one spot at several heights, or nearly. */
import type { Stop } from './route.ts';

/** In route order, never empty; drawn where the first stands. */
export type Stack = readonly Stop[];

/** Each stop joins the first stack whose place is within reach, metres in plan. */
export function stacksOf(stops: readonly Stop[], reachM: number): Stack[] {
  const stacks: Stop[][] = [];
  for (const stop of stops) {
    const [x, y] = stop.positionM;
    const near = stacks.find(([{ positionM }]) => Math.hypot(positionM[0] - x, positionM[1] - y) < reachM);
    if (near === undefined) stacks.push([stop]);
    else near.push(stop);
  }
  return stacks;
}

/** The stop that a stack shows: the next of the route, else the first that is not done, else the first. */
export function shownOf(stack: Stack, next: Stop | null, done: ReadonlySet<string>): Stop {
  return (
    stack.find((stop) => stop.stationId === next?.stationId) ??
    stack.find(({ stationId }) => !done.has(stationId)) ??
    stack[0]
  );
}
