/** The numbers at the rim of the matrix: as many as can be read, those of columns turned on end. In units of cells. */

/** Height of a figure, its width, and the least room from one to the next. */
const FONT_PX = 10;
const FIGURE_PX = 6;
const LINE_PX = 11.5;
const GAP_PX = 4;

export interface Rim {
  /** Width of the rim above and beside the cells. */
  readonly width: number;
  readonly fontSize: number;
  /** From the numbers to the cells. */
  readonly gap: number;
  /** Whether the station at a place is numbered; the one that is pointed at has a number of its own, and room for it. */
  isNumbered(place: number, pointed: number | undefined): boolean;
}

/** Of a matrix of `n` stations, `widthPx` wide with its rim, whose numbers have up to `nFigures` figures. */
export function rimOf(n: number, widthPx: number, nFigures: number): Rim {
  const rimPx = nFigures * FIGURE_PX + 2 * GAP_PX;
  const cellPx = (widthPx - rimPx) / Math.max(1, n);
  const line = LINE_PX / cellPx;
  const step = Math.max(1, Math.ceil(line));
  return {
    width: rimPx / cellPx,
    fontSize: FONT_PX / cellPx,
    gap: GAP_PX / cellPx,
    isNumbered: (place, pointed) => place % step === 0 && (pointed === undefined || Math.abs(place - pointed) >= line),
  };
}
