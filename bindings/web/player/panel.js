// The panels beside the picture: operating points, and figures.

/** The axes of an operating point, and what their steps are called. */
const AXES = [
  ['spatial', 'Detail layer'],
  ['temporal', 'Frame rate'],
  ['refinement', 'Refinement'],
];

const number = (value, digits = 0) =>
  value.toLocaleString('en', { minimumFractionDigits: digits, maximumFractionDigits: digits });

/** Bits a second in words. */
export function rateText(bytes) {
  const bits = 8 * bytes;
  return bits >= 1e6 ? `${number(bits / 1e6, 1)} Mbit/s` : `${number(bits / 1e3)} kbit/s`;
}

/** Bytes in words. */
export const sizeText = (bytes) => (bytes >= 1e6 ? `${number(bytes / 1e6, 1)} MB` : `${number(bytes / 1e3)} kB`);

/** What a step of an axis means. */
function stepText(axis, value, { highest, frameSeconds }) {
  if (axis === 'temporal') return `${number(1 / frameSeconds / 2 ** (highest.temporal - value), 1).replace('.0', '')} fps`;
  return `${value + 1} of ${highest[axis] + 1}`;
}

/**
 * Sliders for an operating point. `onchange` is given the new one. Axes of one step are left out; null if all are. Of a package
 * `isAutomatic` says whether the network decides, and `onchange` is given an empty point if it shall.
 */
export function pointPanel(title, description, point, onchange, isAutomatic = null) {
  const axes = AXES.filter(([axis]) => description.highest[axis] > 0);
  if (axes.length === 0) return null;
  const panel = document.createElement('section');
  panel.className = 'panel';
  panel.setAttribute('aria-label', title);
  const heading = document.createElement('h2');
  heading.textContent = title;
  panel.append(heading);
  const key = isAutomatic === null ? null : automaticKey(isAutomatic, () => onchange({}));
  if (key) panel.append(key);
  const chosen = { ...point };
  const onmove = (moved) => {
    if (key) markAutomatic(key, false);
    onchange(moved);
  };
  for (const [axis, name] of axes) panel.append(axisSlider(axis, name, description, chosen, onmove));
  return panel;
}

/** A key that leaves the operating point to the network. */
function automaticKey(isAutomatic, onpress) {
  const key = document.createElement('button');
  key.className = 'automatic';
  key.id = 'automatic';
  markAutomatic(key, isAutomatic);
  key.addEventListener('click', onpress);
  return key;
}

function markAutomatic(key, isAutomatic) {
  key.textContent = isAutomatic ? 'Automatic: what the network allows' : 'Choose automatically';
  key.setAttribute('aria-pressed', String(isAutomatic));
}

function axisSlider(axis, name, description, chosen, onchange) {
  const label = document.createElement('label');
  label.className = 'axis';
  const output = document.createElement('output');
  const input = document.createElement('input');
  Object.assign(input, { type: 'range', min: 0, max: description.highest[axis], step: 1, value: chosen[axis] });
  input.dataset.axis = axis;
  // The label is that of its first field, the output.
  input.setAttribute('aria-label', name);
  const show = () => {
    const text = stepText(axis, Number(input.value), description);
    output.textContent = text;
    input.setAttribute('aria-valuetext', text);
    input.style.setProperty('--done', `${(100 * input.value) / input.max}%`);
  };
  show();
  input.addEventListener('input', () => {
    chosen[axis] = Number(input.value);
    show();
    onchange({ ...chosen });
  });
  label.append(name, output, input);
  return label;
}

/** Figures as rows of name and value. */
export function figures(rows) {
  const list = document.createElement('dl');
  for (const [name, value] of rows) {
    const [term, detail] = [document.createElement('dt'), document.createElement('dd')];
    term.textContent = name;
    detail.textContent = value;
    list.append(term, detail);
  }
  return list;
}

/** An operating point as text. Without a temporal layer one picture stands for a GOP. */
export const pointText = ({ spatial, temporal, refinement }) => `s${spatial},${temporal === null ? 'i' : `t${temporal}`},r${refinement}`;

/** The figures of a package. */
function packageFigures({ package: state, isAutomatic }) {
  const { point, quality, rate, throughput, buffer, stalls, stalled, requests, failures, abandoned } = state;
  const shown = point ? `${pointText(point)}${isAutomatic ? ', automatic' : ''}` : '–';
  return [
    ['Operating point', shown],
    ['Quality', point ? `${number(quality, 1)} dB` : '–'],
    ['Bit rate of the GOP', point ? rateText(rate / 8) : '–'],
    ['Network', throughput > 0 ? rateText(throughput / 8) : '–'],
    ['Buffered', `${number(buffer, 1)} s`],
    ['Stalls', stalls > 0 ? `${number(stalls)}, ${number(stalled, 1)} s` : '0'],
    ['Requests', `${number(requests)}${failures ? `, ${number(failures)} failed` : ''}${abandoned ? `, ${number(abandoned)} given up` : ''}`],
  ];
}

/** The figures of a track, and of drawing. */
export function trackFigures(track, { interval, pixels, received, total }) {
  const { frame, statistics: times } = track;
  const milliseconds = (value) => `${number(value, 1)} ms`;
  return [
    ...(track.package ? packageFigures(track) : []),
    ['Gaussians decoded', frame ? number(frame.gaussians) : '–'],
    ['Gaussians drawn', number(track.scene.count)],
    ['Carried over', frame ? number(frame.carried) : '–'],
    ['Bit rate', times.rate > 0 ? rateText(times.rate) : '–'],
    ['Received', total && total !== received ? `${sizeText(received)} of ${sizeText(total)}` : sizeText(received)],
    ['Decode', milliseconds(times.decode)],
    ['Pack and sort', milliseconds(times.pack + times.sort)],
    ['Upload', `${milliseconds(times.upload)}, ${sizeText(times.uploaded)}`],
    ['Picture to picture', interval === null ? '–' : milliseconds(interval)],
    ['Picture', pixels.join(' × ')],
    ['Decoder memory', sizeText(times.memory)],
  ];
}
