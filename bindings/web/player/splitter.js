// The line between two pictures that are compared, and what stands on either side.

import { pointText } from './panel.js';

export class Splitter {
  #line;
  #names;
  #stage;

  constructor(root, stage) {
    this.#stage = stage;
    this.#line = root.getElementById('split');
    this.#names = ['left-name', 'right-name'].map((id) => root.getElementById(id));
    this.#line.addEventListener('pointerdown', (event) => this.#line.setPointerCapture(event.pointerId));
    this.#line.addEventListener('pointermove', (event) => {
      if (!this.#line.hasPointerCapture(event.pointerId)) return;
      const { left, width } = root.host.getBoundingClientRect();
      this.#move((event.clientX - left) / width);
    });
    this.#line.addEventListener('keydown', (event) => {
      const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
      if (step) this.#move(this.#stage.split + step);
    });
  }

  /** Shows the line between two tracks. */
  show(tracks) {
    this.#line.hidden = false;
    this.#move(0.5);
    this.name(tracks);
  }

  hide() {
    for (const element of [this.#line, ...this.#names]) element.hidden = true;
  }

  /** Writes the operating points on the sides. */
  name(tracks) {
    if (tracks.length < 2) return;
    this.#names.forEach((element, side) => {
      element.hidden = false;
      element.textContent = pointText(tracks[side].point);
    });
  }

  #move(share) {
    const split = Math.min(0.98, Math.max(0.02, share));
    this.#stage.split = split;
    this.#line.style.left = `${100 * split}%`;
    this.#line.setAttribute('aria-valuenow', String(Math.round(100 * split)));
    this.#names[0].style.right = `calc(${100 - 100 * split}% + 22px)`;
    this.#names[1].style.left = `calc(${100 * split}% + 22px)`;
    this.#stage.invalidate();
  }
}
