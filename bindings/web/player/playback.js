// The clock: which frame is due. It knows nothing of pages.

/** Frames that are left out at once, at most, where decoding is slower than the clock. */
const MOST_SKIPPED = 6;
/** The clock waits for frames that are later than this, seconds. */
const LATEST = 0.25;

/** Milliseconds that the clock waits for the frame of a package that was sought while it plays. */
const PATIENCE = 1000;

/** A frame that stands for others is followed by the next one so many frames before that is due. */
const AHEAD = 2;

/** Plays tracks by one clock. Times are seconds of the stream; with a loop they go on counting in the next round. */
export class Playback {
  isPlaying = false;
  isLooping = true;
  /** Seconds of a frame, and frames in the stream; 0 as long as that is not known. */
  frameSeconds = 1 / 30;
  frames = 0;
  /** The first frame that can be shown. While a presentation grows this one and the number of frames change. */
  first = 0;
  isLive = false;
  /** What is known of a package; null of a stream. */
  #package = null;
  #hasPlayed = false;
  /** How many seeks hold the clock. */
  #holds = 0;
  #tracks;
  #speed = 1;
  /** Where the clock stands, and when it was looked at last, milliseconds. */
  #time = 0;
  #last = null;
  /** Of each track the round of the frame that comes next, and when the one that is there was due. */
  #places = new Map();

  constructor(tracks) {
    this.#tracks = tracks;
    this.#rewind();
    const [leader] = tracks;
    leader.addEventListener('jumped', ({ detail }) => this.#jump(detail));
    leader.addEventListener('package', ({ detail }) => this.#follow(detail));
  }

  /** The clock goes on from a frame. */
  #jump({ time }) {
    this.#time = time;
    this.#rewind();
  }

  /** Takes how far a presentation has grown. */
  #follow(state) {
    this.#package = state;
    if (state.isLive || this.isLive) [this.first, this.frames] = [state.first, state.frames];
    this.isLive = state.isLive;
  }

  /** Whether there is more than one frame, or may be. */
  get isMoving() {
    return this.isLive || this.frames !== 1;
  }

  #rewind() {
    for (const track of this.#tracks) this.#places.set(track, { round: 0, shownAt: this.#time });
  }

  /** Seconds of all that can be shown; 0 as long as that is not known. */
  get duration() {
    return (this.frames - this.first) * this.frameSeconds;
  }

  /** Where the clock stands in the stream, seconds. */
  get time() {
    if (this.isLive || this.duration <= 0) return this.#time;
    const start = this.first * this.frameSeconds;
    return start + (Math.max(0, this.#time - start) % this.duration);
  }

  /** The frame that is due. */
  get index() {
    return Math.floor(this.time / this.frameSeconds + 1e-6);
  }

  get speed() {
    return this.#speed;
  }

  set speed(speed) {
    this.#speed = speed;
    this.pace();
  }

  /** Says how fast packages are played. */
  pace() {
    for (const track of this.#tracks) track.run(this.isPlaying && this.#holds === 0 ? this.#speed : 0);
  }

  /** Takes what the stream says of its length. */
  describe({ frames, frameSeconds }) {
    if (!this.isLive) this.frames = frames;
    this.frameSeconds = frameSeconds || 1 / 30;
  }

  /** Takes the end of a track: the length of a stream that did not say it. */
  ended({ frame }) {
    if (this.frames === 0 && frame) this.frames = frame.index + 1;
  }

  play() {
    if (!this.isMoving) return;
    if (!this.isLive && !this.isLooping && this.frames > 0 && this.index >= this.frames - 1) this.seek(this.first);
    // Who starts later than the page has loaded wants to see what is being made.
    if (!this.#hasPlayed && this.#package?.isBehind) this.goLive();
    this.#hasPlayed = true;
    this.isPlaying = true;
    this.#last = null;
    this.pace();
  }

  pause() {
    this.isPlaying = false;
    this.pace();
  }

  /** Goes to where a presentation that grows is followed. */
  goLive() {
    if (this.isLive) this.seek(this.#package.edge);
  }

  /** A frame that stands still can be had better: shows the one that is due. */
  improve(track) {
    if (track.frame && !track.isBusy) track.seek(this.index);
  }

  /** Goes to a frame, which is shown as soon as it is there. */
  seek(index) {
    const last = this.frames > 0 ? this.frames - 1 : index;
    const frame = Math.max(this.first, Math.min(index, last));
    this.#time = frame * this.frameSeconds;
    this.#rewind();
    for (const track of this.#tracks) track.seek(frame);
  }

  /**
   * Goes to a frame; resolves when it is shown, or else the nearest one before it that can be had. Of a package the first frame
   * of a GOP is there before the others, and what stands still gets better: so the clock stands for a while.
   */
  async reach(index) {
    const [leader] = this.#tracks;
    this.seek(index);
    if (leader.package === null) return leader.settled();
    this.#hold(1);
    let timer;
    const isLate = new Promise((resolve) => (timer = setInterval(() => this.isPlaying && resolve(), PATIENCE)));
    await Promise.race([leader.settled(), isLate]);
    clearInterval(timer);
    return this.#hold(-1);
  }

  #hold(by) {
    this.#holds += by;
    this.pace();
  }

  /** Shows what is due, and asks for what comes next. `now` is in milliseconds. */
  tick(now) {
    const passed = this.#last === null ? 0 : (now - this.#last) / 1000;
    this.#last = now;
    if (!this.isPlaying || this.#holds > 0) return;
    if (this.#tracks.some((track) => track.frame === null)) return;
    this.#time += passed * this.#speed * (this.#package?.pace ?? 1);
    for (const track of this.#tracks) this.#serve(track);
    if (this.#tracks.every((track) => track.isEnded && track.heldTime === null)) this.#finish();
  }

  #serve(track) {
    const place = this.#places.get(track);
    if (track.heldTime !== null) {
      const due = track.heldTime + place.round * this.duration;
      if (due > this.#time) return;
      track.release();
      // Frames that come late hold the clock.
      if (this.#time - due > LATEST) this.#time = due;
      place.shownAt = due;
    }
    if (track.isBusy) {
      this.#time = Math.min(this.#time, place.shownAt + LATEST + 8 * this.frameSeconds);
    } else if (!track.isEnded && track.frame.until > track.frame.index + 1 && this.index + AHEAD < track.frame.until) {
      place.shownAt = this.#time;
    } else if (!track.isEnded) {
      track.prefetch(this.#nextIndex(track));
    } else if (this.isLooping && this.duration > 0 && !track.error) {
      place.round += 1;
      track.isEnded = false;
      track.prefetch(this.first);
    }
  }

  #nextIndex(track) {
    const next = track.frame.until;
    return Math.max(next, Math.min(this.index, next + MOST_SKIPPED));
  }

  #finish() {
    if (this.isLooping) return;
    this.pause();
    this.#time = Math.max(this.first, this.frames - 1) * this.frameSeconds;
  }
}
