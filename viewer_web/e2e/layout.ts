/** What is wrong with where things are on a page: words that are cut, controls that lie on each other, and those beyond the window. */
import type { Page } from 'playwright-core';

/**
 * One line each, by boxes and not by pixels. Words may be cut where a title has them whole. What scrolls up and down may be
 * cut by its window; an open popover may cover what is below it. Numbers of stations may touch each other: they follow the
 * camera, and those that crowd become dots.
 */
export function layoutFaults(page: Page): Promise<string[]> {
  return page.evaluate(() => {
    const SLACK = 1.5;
    const PANELS =
      '.tool-group, .card, .legend, .plan-scale, .covered-note, .walk, .walk-map, .view-cube, .draft-bar, .messages, .tip, .sheet, .toolbar-below';
    const CONTROLS = 'button, a[href], input, select, textarea, summary';
    interface Box {
      left: number;
      top: number;
      right: number;
      bottom: number;
    }
    const shared = (a: Box, b: Box): Box => ({
      left: Math.max(a.left, b.left),
      top: Math.max(a.top, b.top),
      right: Math.min(a.right, b.right),
      bottom: Math.min(a.bottom, b.bottom),
    });
    const isThere = ({ left, top, right, bottom }: Box): boolean => right - left > SLACK && bottom - top > SLACK;
    const isIn = (a: Box, b: Box): boolean =>
      a.left > b.left - SLACK && a.top > b.top - SLACK && a.right < b.right + SLACK && a.bottom < b.bottom + SLACK;
    const isShown = (one: Element): boolean =>
      one.checkVisibility({ visibilityProperty: true, opacityProperty: true }) && isThere(one.getBoundingClientRect());
    const named = (one: Element): string => {
      const words = (one.getAttribute('aria-label') ?? one.textContent ?? '').trim().replace(/\s+/g, ' ').slice(0, 60);
      return `${one.tagName.toLowerCase()}${one.classList.length > 0 ? `.${one.classList[0]}` : ''} "${words}"`;
    };
    const ancestors = function* (from: Element): Generator<[HTMLElement, CSSStyleDeclaration]> {
      for (let one = from.parentElement; one !== null; one = one.parentElement) yield [one, getComputedStyle(one)];
    };
    const cuts = (overflow: string): boolean => overflow === 'hidden' || overflow === 'clip';
    const window_: Box = { left: 0, top: 0, right: window.innerWidth, bottom: window.innerHeight };
    /** What of a box is seen, and what cuts it for good: scrolling brings no more of it. */
    const seenOf = (one: Element, box: Box): { box: Box; cutBy: string | null } => {
      let [seen, cutBy] = [box, null as string | null];
      const { position } = getComputedStyle(one);
      let isFixed = position === 'fixed';
      for (const [each, { overflowX, overflowY, position: at }] of ancestors(one)) {
        if (isFixed) break;
        isFixed = at === 'fixed';
        if (overflowX === 'visible' && overflowY === 'visible') continue;
        const { left, top } = each.getBoundingClientRect();
        const [x, y] = [left + each.clientLeft, top + each.clientTop];
        const own = { left: x, top: y, right: x + each.clientWidth, bottom: y + each.clientHeight };
        const isCutAcross = seen.left < own.left - SLACK || seen.right > own.right + SLACK;
        const isCutDown = seen.top < own.top - SLACK || seen.bottom > own.bottom + SLACK;
        // What has to be scrolled sideways is not found.
        if (isCutAcross && overflowX !== 'visible') cutBy ??= named(each);
        if (isCutDown && cuts(overflowY)) cutBy ??= named(each);
        seen = shared(seen, own);
      }
      return { box: shared(seen, window_), cutBy: cutBy ?? (isFixed && !isIn(box, window_) ? 'the window' : null) };
    };
    const faults: string[] = [];
    const popover = document.querySelector('[data-popover]');
    const hasTitle = (one: Element): boolean => one.closest('[title]:not([title=""])') !== null;

    // Words.
    const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let text = texts.nextNode(); text !== null; text = texts.nextNode()) {
      const parent = text.parentElement!;
      if (!text.textContent?.trim() || !isShown(parent)) continue;
      if (parent.closest('option, svg, .marker, .room-name, .ghost-marker, [data-clipped]') !== null) continue;
      const range = document.createRange();
      range.selectNodeContents(text);
      const box = range.getBoundingClientRect();
      const words = text.textContent.trim().slice(0, 60);
      const { cutBy } = seenOf(parent, box);
      const own = getComputedStyle(parent);
      const cutsItself = cuts(own.overflowX) && parent.scrollWidth > parent.clientWidth + SLACK;
      if ((cutBy !== null || cutsItself) && !hasTitle(parent))
        faults.push(`cut: "${words}" by ${cutBy ?? named(parent)}`);
      const control = parent.closest(`${CONTROLS}, label.tool, .badge, .segments`);
      if (control !== null && own.display !== 'inline' && !isIn(box, control.getBoundingClientRect())) {
        faults.push(`beyond its own box: "${words}" in ${named(control)}`);
      }
    }
    for (const select of document.querySelectorAll('select')) {
      if (!isShown(select) || hasTitle(select)) continue;
      const context = document.createElement('canvas').getContext('2d')!;
      context.font = getComputedStyle(select).font;
      const words = select.selectedOptions[0]?.text ?? '';
      // Beside the words a list has its arrow.
      if (context.measureText(words).width + 16 > select.clientWidth)
        faults.push(`cut: "${words}" by ${named(select)}`);
    }

    // Controls.
    const controls = [...document.querySelectorAll(CONTROLS)].filter(isShown).map((one) => {
      const whole = one.getBoundingClientRect();
      return { one, whole, isMarker: one.matches('.marker'), ...seenOf(one, whole) };
    });
    for (const { one, whole, box, cutBy, isMarker } of controls) {
      if (isMarker) continue;
      if (cutBy !== null) faults.push(`out of reach: ${named(one)}, cut by ${cutBy}`);
      if (!isIn(whole, box) || !isThere(box)) continue;
      const under = document.elementFromPoint((box.left + box.right) / 2, (box.top + box.bottom) / 2);
      const label = one.closest('label');
      const isHit = under !== null && (one.contains(under) || under.contains(one) || label?.contains(under));
      // Lists scroll below a head that stays.
      const isHead = under?.closest('.verdict') !== null;
      if (!isHit && !isHead && !(popover?.contains(under) ?? false))
        faults.push(`covered: ${named(one)} by ${under && named(under)}`);
    }
    for (const [i, a] of controls.entries()) {
      for (const b of controls.slice(i + 1)) {
        if (a.isMarker && b.isMarker) continue;
        if (a.one.contains(b.one) || b.one.contains(a.one)) continue;
        if (popover !== null && popover.contains(a.one) !== popover.contains(b.one)) continue;
        // A number below a panel as a whole is not to be hit there.
        if ([a, b].some(({ one, isMarker }) => isMarker && (one as HTMLElement).tabIndex < 0)) continue;
        const [first, second] = [a.box, b.box];
        const isInWindow = isThere(first) && isThere(second);
        if (isInWindow && isThere(shared(first, second)))
          faults.push(`on each other: ${named(a.one)} and ${named(b.one)}`);
      }
    }
    const panels = [...document.querySelectorAll(PANELS)].filter(isShown).map((one) => ({
      one,
      box: seenOf(one, one.getBoundingClientRect()).box,
    }));
    for (const [i, a] of panels.entries()) {
      for (const b of panels.slice(i + 1)) {
        if (a.one.contains(b.one) || b.one.contains(a.one)) continue;
        if (isThere(shared(a.box, b.box))) faults.push(`on each other: ${named(a.one)} and ${named(b.one)}`);
      }
    }
    return faults;
  });
}
