// Icons: paths in a square of 24 units, drawn with the colour of the text.

const PATHS = {
  play: '<path d="M8 5.5v13l11-6.5z" fill="currentColor" stroke="none"/>',
  pause: '<path d="M8 5.5v13M16 5.5v13" stroke-width="3"/>',
  loop: '<path d="M4 11a6 6 0 0 1 6-5h9m-3-3 3 3-3 3M20 13a6 6 0 0 1-6 5H5m3 3-3-3 3-3"/>',
  layers: '<path d="m12 3.5 9 4.7-9 4.7-9-4.7zM3 12.3l9 4.7 9-4.7M3 16.4l9 4.7 9-4.7"/>',
  compare: '<path d="M12 3v18M9 7H4v10h5M15 7h5v10h-5" />',
  info: '<circle cx="12" cy="12" r="8.5"/><path d="M12 11v5.5M12 7.6v.4" stroke-width="2.2"/>',
  fly: '<path d="m20.5 3.5-17 7 7 3 3 7zM10.500 13.500l4-4"/>',
  home: '<path d="M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5M12 9.500v5M9.500 12h5"/>',
  full: '<path d="M9 4H4v5M15 4h5v5M9 20H4v-5M15 20h5v-5"/>',
  warning: '<path d="M12 4 2.800 20h18.400zM12 10v4.500M12 17.200v.3" stroke-width="2"/>',
  open: '<path d="M12 16V5m-4.500 4.500L12 5l4.500 4.500M4 15v4h16v-4"/>',
};

/** An icon as SVG, which readers of screens skip. */
export const icon = (name) =>
  `<svg viewBox="0 0 24 24" aria-hidden="true" fill="none" stroke="currentColor" stroke-width="1.8" stroke-linecap="round" stroke-linejoin="round">${PATHS[name]}</svg>`;
