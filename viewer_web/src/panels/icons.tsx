/** Signs of the toolbar: lines on a grid of 20. */

const PATHS = {
  panel: 'M3 4h14v12H3zM8 4v12',
  cube: 'M10 2.5 16.5 6v8L10 17.5 3.5 14V6zM3.5 6 10 9.5 16.5 6M10 9.5v8',
  top: 'M10 2.5v7M7 7l3 3 3-3M3 13l7-2.5 7 2.5-7 4.5z',
  plan: 'M3 3h14v14H3zM3 10h5M11 10h6M11 3v4M11 10v7',
  walk: 'M10.5 4.6a1.3 1.3 0 1 0 0-2.6 1.3 1.3 0 0 0 0 2.6zM7 18l2-5.5V7.5L6.5 9v2.5M9 7.5l2 .3 1.5 2.2 2 .8M9 12.5l3 2V18',
  view: 'M2 10s3-5.5 8-5.5S18 10 18 10s-3 5.5-8 5.5S2 10 2 10zM10 12.5a2.5 2.5 0 1 0 0-5 2.5 2.5 0 0 0 0 5z',
  colour: 'M10 2.5s5.5 6 5.5 9.5a5.5 5.5 0 0 1-11 0c0-3.5 5.5-9.5 5.5-9.5zM10 14.5a2.5 2.5 0 0 0 2.5-2.5',
  hatch: 'M3.5 3.5h13v13h-13zM3.5 9 9 3.5M3.5 15 15 3.5M5 16.5 16.5 5M11 16.5l5.5-5.5',
  show: 'M10 3 17 7l-7 4-7-4zM3 10.2l7 4 7-4M3 13.4l7 4 7-4',
  views: 'M5 2.5h10v15l-5-4-5 4z',
  link: 'M8.5 11.5a3 3 0 0 0 4.3 0l3-3a3 3 0 0 0-4.3-4.3l-1 1M11.5 8.5a3 3 0 0 0-4.3 0l-3 3a3 3 0 0 0 4.3 4.3l1-1',
  rename: 'M12.5 4.5l3 3M4 16l.7-3.7L14 3a1.4 1.4 0 0 1 2 0l1 1a1.4 1.4 0 0 1 0 2l-9.3 9.3z',
  remove: 'M3.5 5.5h13M8 5.5v-2h4v2M5.5 5.5l.7 11h7.6l.7-11M8.5 8.5v5M11.5 8.5v5',
  links: 'M5 14.5a2 2 0 1 0 0-4 2 2 0 0 0 0 4zM15 9a2 2 0 1 0 0-4 2 2 0 0 0 0 4zM6.8 11.6l6.4-3.6M6.9 13.4 12 16',
  clouds:
    'M4 6.5h.01M8 4.5h.01M12 5.5h.01M16 7h.01M5 10.5h.01M9 9h.01M13 10h.01M16.5 12h.01M4 14.5h.01M8 13.5h.01M12 14.5h.01M15.5 16h.01M8.5 17h.01',
  // Drawn, not written: as a word it would be the name of its button.
  feet: 'M8.5 5c-2.4-.9-3.6.2-3.6 2.4V15.5M3 9h5M12.8 5.5v7.6c0 1.9 1.1 2.5 3.2 2M10.6 9h5.2',
  measure: 'M2.5 13 13 2.5 17.5 7 7 17.5zM5.5 10l2 2M8 7.5l1.3 1.3M10.5 5l2 2',
  section: 'M3 6.5 9 3.5l8 3v7l-6 3-8-3zM10 1v18',
  tools: 'M12 4.5a3.8 3.8 0 0 0 4.2 5L9.5 16.2a1.9 1.9 0 0 1-2.7-2.7L13.5 6.8M12 4.5 14 2.6M16.2 9.5 18 7.7',
  share: 'M10 2.5v9.5M6.5 8.5 10 12l3.5-3.5M3.5 13v4h13v-4',
} as const;

export type IconName = keyof typeof PATHS;

export function Icon({ name }: { name: IconName }) {
  return (
    <svg class="tool-icon" viewBox="0 0 20 20" width="20" height="20" aria-hidden="true">
      <path class={name === 'clouds' ? 'tool-icon-dots' : undefined} d={PATHS[name]} />
    </svg>
  );
}
