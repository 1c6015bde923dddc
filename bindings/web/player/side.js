// The side of the picture: which of its panels is open, and what is in it, one for each track.

import { figures, pointPanel, trackFigures } from './panel.js';

/** Milliseconds between two updates of the figures. */
const FIGURES = 250;

/** Where a track is when two are compared. */
const WHERE = [' on the left', ' on the right'];

export class Side {
  /** The panel that is open: quality, info, or null. */
  open = null;
  #panels;
  #keys;
  #known;
  #onpoint;
  #figuresAt = 0;

  /**
   * `known` gives what there is to show: tracks, the description, and figures that they share. `onpoint` is given a track and the
   * operating point that is chosen for it.
   */
  constructor(root, known, onpoint) {
    this.#panels = root.getElementById('side');
    this.#keys = ['quality', 'info'].map((id) => root.getElementById(id));
    [this.#known, this.#onpoint] = [known, onpoint];
  }

  /** Opens a panel in place of the other; null closes it. */
  show(name) {
    this.open = name;
    for (const key of this.#keys) key.setAttribute('aria-expanded', String(key.id === name));
    this.fill();
  }

  toggle(name) {
    this.show(this.open === name ? null : name);
  }

  /** Fills the open panel with what is known now. */
  fill() {
    const known = this.#known();
    const isCompared = known.tracks.length > 1;
    const panels = known.tracks.map((track, place) => this.#panel(known, track, isCompared ? WHERE[place] : ''));
    const filled = panels.filter(Boolean);
    this.#panels.replaceChildren(...filled);
    this.#panels.hidden = filled.length === 0;
  }

  /** Fills figures again, some times a second. */
  refresh() {
    const now = performance.now();
    if (this.open !== 'info' || now - this.#figuresAt <= FIGURES) return;
    this.#figuresAt = now;
    this.fill();
  }

  #panel(known, track, where) {
    if (this.open === 'quality') return this.#pointPanel(known, track, `Operating point${where}`);
    if (this.open === 'info') return this.#infoPanel(known, track, `Figures${where}`);
    return null;
  }

  #pointPanel({ description }, track, title) {
    const point = { ...description.highest, ...track.point };
    const onchange = (chosen) => this.#onpoint(track, chosen);
    return pointPanel(title, description, point, onchange, track.package ? track.isAutomatic : null);
  }

  #infoPanel({ shared }, track, title) {
    const panel = document.createElement('section');
    panel.className = 'panel';
    const heading = document.createElement('h2');
    heading.textContent = title;
    panel.append(heading, figures(trackFigures(track, shared)));
    return panel;
  }
}
