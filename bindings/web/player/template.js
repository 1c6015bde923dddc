// The elements of the player.

import { icon } from './icons.js';
import { STYLE } from './style.js';

const key = (id, name, picture, more = '') =>
  `<button id="${id}" aria-label="${name}" title="${name}" ${more}>${icon(picture)}</button>`;
const toggle = (id, name, picture, isOn = false, more = '') => key(id, name, picture, `aria-pressed="${isOn}" ${more}`);

export const TEMPLATE = `
<style>${STYLE}</style>
<canvas id="canvas" tabindex="0" role="application" aria-label="Three-dimensional scene. Arrow keys or drags look around, scrolling zooms; W A S D Q E move; space plays."></canvas>
<button class="split" id="split" role="slider" aria-label="Where the pictures are divided" aria-valuemin="0" aria-valuemax="100" aria-valuenow="50" hidden></button>
<div class="side-name panel" id="left-name" hidden></div>
<div class="side-name panel" id="right-name" hidden></div>
<div class="message" id="message">
  <div class="ring" id="ring" hidden></div>
  <p id="said" role="status"></p>
  <button class="open" id="open" hidden>${icon('open')} Open a .gss file</button>
  <input type="file" id="file" accept=".gss" aria-label="A .gss file" hidden>
</div>
<div class="head">
  <div class="title panel" id="title" hidden></div>
  <details class="lost panel" id="lost" hidden>
    <summary>${icon('warning')}<span id="lost-count" role="status"></span></summary>
    <ul id="lost-list"></ul>
  </details>
</div>
<div class="bar panel" id="bar" role="group" aria-label="Playback" hidden>
  <div class="timeline" id="timeline"><input type="range" id="place" min="0" max="0" step="1" value="0" aria-label="Frame"></div>
  <div class="keys">
    ${key('play', 'Play (space)', 'play')}
    <div class="time" id="time"></div>
    <button class="live" id="live" title="Go to what is being made now (End)" hidden>Live</button>
    <select id="speed" aria-label="Speed" title="Speed">
      ${[0.25, 0.5, 1, 2].map((speed) => `<option value="${speed}" ${speed === 1 ? 'selected' : ''}>${speed}×</option>`).join('')}
    </select>
    ${toggle('loop', 'Loop (L)', 'loop', true, 'class="wide"')}
    <div class="space"></div>
    ${key('quality', 'Operating point (O)', 'layers', 'aria-expanded="false" aria-controls="side"')}
    ${toggle('compare', 'Compare two operating points (C)', 'compare')}
    ${key('info', 'Figures (I)', 'info', 'aria-expanded="false" aria-controls="side"')}
    ${toggle('fly', 'Fly instead of orbit (F)', 'fly', false, 'class="wide"')}
    ${key('home', 'Reset the view (R)', 'home')}
    ${key('full', 'Full screen', 'full')}
  </div>
</div>
<div class="side" id="side"></div>
<div class="drop" id="drop" hidden></div>`;
