// The part of the bar that is about time: where playback stands, how much is there, whether it follows what is being made.

const clock = (seconds) => `${Math.floor(seconds / 60)}:${(seconds % 60).toFixed(1).padStart(4, '0')}`;

export class Timeline {
  #place;
  #time;
  #live;
  /** Keys of what moves, and those among them that make no sense while a presentation grows. */
  #moving;
  #recorded;

  constructor(root) {
    const all = (...names) => names.map((name) => root.getElementById(name));
    [this.#place, this.#time, this.#live] = all('place', 'time', 'live');
    this.#moving = all('timeline', 'play', 'time');
    this.#recorded = all('speed', 'loop');
  }

  /** Shows the keys that a playback needs. */
  prepare({ isMoving, isLive }) {
    this.#live.hidden = !isLive;
    for (const key of this.#moving) key.hidden = !isMoving;
    for (const key of this.#recorded) key.hidden = !isMoving || isLive;
  }

  /** Marks the share of the frames that are there, from 0 to 1. */
  fill(share) {
    this.#place.style.setProperty('--there', `${100 * share}%`);
  }

  /** Takes what is known of a package: how far it is buffered and has grown. */
  follow({ buffered, isLive, isBehind }, playback) {
    const { first, frames } = playback;
    if (frames > first) this.fill((buffered - first) / (frames - first));
    if (this.#live.hidden === isLive) this.prepare(playback);
    this.#live.setAttribute('aria-pressed', String(isLive && !isBehind));
  }

  /** Shows where playback stands; `frame` is what is shown while it does not move. */
  show(playback, frame) {
    const { frames, first, frameSeconds, time, isPlaying, isLive } = playback;
    const place = this.#place;
    const index = isPlaying ? Math.round(time / frameSeconds) : (frame?.index ?? 0);
    const shown = frames > 0 ? Math.min(index, frames - 1) : index;
    place.min = first;
    place.max = Math.max(first + 1, frames - 1);
    if (!place.matches(':active')) place.value = shown;
    place.style.setProperty('--done', `${(100 * (place.value - first)) / (place.max - first)}%`);
    const end = isLive ? '' : ` <span>/ ${clock(frames * frameSeconds)}</span>`;
    const text = `${clock(shown * frameSeconds)}${end}`;
    if (this.#time.innerHTML !== text) this.#time.innerHTML = text;
    place.setAttribute('aria-valuetext', `frame ${shown} of ${frames}${isLive ? ' so far' : ''}`);
  }
}
