// What is said in the middle of the picture.

export class Message {
  #box;
  #said;
  #ring;
  #open;

  constructor(root) {
    [this.#box, this.#said, this.#ring, this.#open] = ['message', 'said', 'ring', 'open'].map((id) => root.getElementById(id));
  }

  /** Says something, or nothing; `isBusy` shows that something is on its way, and `isOpen` a key to open a file with. */
  say(text, { isBusy = false, isOpen = false } = {}) {
    this.#said.textContent = text;
    this.#ring.hidden = !isBusy;
    this.#open.hidden = !isOpen;
    this.#box.hidden = !text && !isBusy;
  }
}
