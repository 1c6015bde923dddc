// What was lost on the way, as a notice that opens to a list.

/** Lines of the list, at most; the rest is counted. */
const MOST = 50;

export class Losses {
  lines = [];
  #notice;
  #count;
  #list;

  constructor(notice, count, list) {
    [this.#notice, this.#count, this.#list] = [notice, count, list];
  }

  /** Adds what was lost before the frame with an index, or after the last one; each line once. */
  add(warnings, index) {
    for (const warning of warnings) {
      const line = index === null ? warning : `Before frame ${index}: ${warning}`;
      if (!this.lines.includes(line)) this.#append(line);
    }
    this.#notice.hidden = this.lines.length === 0;
    this.#count.textContent = this.lines.length === 1 ? 'Something was lost' : `${this.lines.length} losses`;
  }

  clear() {
    this.lines = [];
    this.#list.replaceChildren();
    this.#notice.hidden = true;
    this.#notice.open = false;
  }

  #append(line) {
    this.lines.push(line);
    if (this.lines.length > MOST) return;
    const item = document.createElement('li');
    item.textContent = line;
    this.#list.append(item);
  }
}
