// Files that somebody chooses or drops on the player.

/** Gives the bytes of each file to `open`. */
export function listenToFiles(player, root, open) {
  const find = (id) => root.getElementById(id);
  const take = async (file) => file && open(await file.arrayBuffer());
  const mark = (isOver) => (event) => {
    event.preventDefault();
    find('drop').hidden = !isOver;
  };
  find('open').addEventListener('click', () => find('file').click());
  find('file').addEventListener('change', ({ target }) => take(target.files[0]));
  player.addEventListener('dragover', mark(true));
  player.addEventListener('dragleave', mark(false));
  player.addEventListener('drop', (event) => {
    mark(false)(event);
    take(event.dataTransfer.files[0]);
  });
}
