// What keys do, wherever the focus is in the player but in a field that uses them itself.

/** The actions by the code of their key. */
const ACTIONS = {
  Space: (player) => player.togglePlay(),
  Comma: (player) => player.step(-1),
  Period: (player) => player.step(1),
  ArrowLeft: (player) => player.look(-1, 0),
  ArrowRight: (player) => player.look(1, 0),
  ArrowUp: (player) => player.look(0, 1),
  ArrowDown: (player) => player.look(0, -1),
  Home: (player) => player.seek(0),
  End: (player) => player.goLive(),
  BracketLeft: (player) => player.changeSpeed(-1),
  BracketRight: (player) => player.changeSpeed(1),
  KeyL: (player) => player.press('loop'),
  KeyO: (player) => player.press('quality'),
  KeyC: (player) => player.press('compare'),
  KeyI: (player) => player.press('info'),
  KeyF: (player) => player.press('fly'),
  KeyR: (player) => player.press('home'),
  Escape: (_player, root) => closeSide(root),
};

/** Closes the panel at the side; the key that has opened it takes the focus. */
function closeSide(root) {
  const key = root.querySelector('[aria-expanded="true"]');
  key?.focus();
  key?.click();
}

/** Whether an element uses a key itself. */
function isOwn(element, code) {
  if (element instanceof HTMLSelectElement) return true;
  if (element instanceof HTMLInputElement || element.getAttribute?.('role') === 'slider') return code.startsWith('Arrow') || code === 'Home' || code === 'End';
  return (element instanceof HTMLButtonElement || element.localName === 'summary') && code === 'Space';
}

/** Lets a player take its keys. */
export function listenToKeys(player, root) {
  root.addEventListener('keydown', (event) => {
    const action = ACTIONS[event.code];
    if (!action || event.ctrlKey || event.metaKey || event.altKey || isOwn(event.target, event.code)) return;
    event.preventDefault();
    action(player, root);
  });
}
