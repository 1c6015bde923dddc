// Rules of dash.js, from its source tree, as a peer of stream/examples/qoe (README.md, Streaming):
//
//     node stream_dashjs.mjs FOLDER dynamic|bola|throughput|l2a|lolp
//
// Its rules, throughput controller, history of switches and settings are its own, with their defaults; what would be the
// player, the clock and the manifest is here. `dynamic` is the default of dash.js. L2A and LoL+ run without other rules.
import { register } from 'node:module';
import { createInterface } from 'node:readline';
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';

const [folder, strategy] = process.argv.slice(2);
// Two packages that the rules reach and do not use.
const parser = 'data:text/javascript,' + encodeURIComponent('export class UAParser { getResult() { return {}; } }');
register('data:text/javascript,' + encodeURIComponent(`
  const stubs = { 'path-browserify': 'node:path', 'ua-parser-js': ${JSON.stringify(parser)} };
  export async function resolve(name, context, next) {
    return stubs[name] ? { url: stubs[name], shortCircuit: true } : next(name, context);
  }`));
globalThis.window = globalThis;
for (const level of ['log', 'info', 'debug', 'warn']) console[level] = () => {};

const START = 1.6e12; // ms: when the virtual clock begins
let now = 0;
Date.now = () => START + now * 1000;
const date = (seconds) => new Date(START + seconds * 1000);

const load = async (path) => (await import(pathToFileURL(resolve(folder, 'src', path)))).default;
const FactoryMaker = await load('core/FactoryMaker.js');
const Settings = await load('core/Settings.js');
const EventBus = await load('core/EventBus.js');
const Events = await load('core/events/Events.js');
const PlayerEvents = await load('streaming/MediaPlayerEvents.js');
const Collection = await load('streaming/rules/abr/ABRRulesCollection.js');
const RulesContext = await load('streaming/rules/RulesContext.js');
const SwitchRequestHistory = await load('streaming/rules/SwitchRequestHistory.js');
const ThroughputController = await load('streaming/controllers/ThroughputController.js');
Events.extend(PlayerEvents); // as its MediaPlayer does

const FIRST_KBIT = 1000; // what dash.js assumes of video before it has measured anything
const ABANDONED_SECONDS = 10; // its abandonLoadTimeout
const context = {};
const settings = Settings(context).getInstance();
const bus = EventBus(context).getInstance();
const active = (names) => Object.fromEntries(
  ['throughputRule', 'bolaRule', 'insufficientBufferRule', 'switchHistoryRule', 'droppedFramesRule', 'abandonRequestsRule',
    'l2ARule', 'loLPRule'].map((name) => [name, { active: names.includes(name) }]));
const always = ['insufficientBufferRule', 'switchHistoryRule', 'droppedFramesRule', 'abandonRequestsRule'];
settings.update({ streaming: { abr: { rules: active({
  dynamic: ['throughputRule', 'bolaRule', ...always],
  bola: ['bolaRule', ...always],
  throughput: ['throughputRule', ...always],
  l2a: ['l2ARule'],
  lolp: ['loLPRule'],
}[strategy]) } } });

const stream = { id: 'stream', manifestInfo: { isDynamic: false } };
const media = { id: 'media', type: 'video', streamInfo: stream };
let gopSeconds, representations, current, buffer = 0, delay = 0, lastRequest = null, abandonedUntil = -1;
let progress = null; // of the running request

const abr = {
  getPossibleVoRepresentationsFilteredBySettings: () => representations,
  getPossibleVoRepresentations: () => representations,
  getOptimalRepresentationForBitrate: (_, kbit) =>
    representations.findLast((one) => one.bitrateInKbit <= kbit) ?? representations[0],
  getRepresentationByAbsoluteIndex: (index) => representations[index],
  isPlayingAtLowestQuality: (one) => one.absoluteIndex === 0,
  isPlayingAtTopQuality: (one) => !one || one.absoluteIndex === representations.length - 1,
  getAbandonmentStateFor: () => (now < abandonedUntil ? 'abandonload' : 'allowload'),
};
FactoryMaker.setSingletonInstance(context, 'AbrController', abr);

const metrics = {
  getCurrentBufferLevel: () => buffer,
  getCurrentBufferState: () => ({ state: buffer > 0 ? 'bufferLoaded' : 'bufferStalled' }),
  getCurrentHttpRequest: () => lastRequest,
};
const playback = {
  getIsDynamic: () => false,
  getLowLatencyModeEnabled: () => false,
  getCurrentLiveLatency: () => 0,
  getPlaybackRate: () => 1,
};
const player = { getBufferTimeDefault: () => settings.get().streaming.buffer.bufferTimeDefault };
const throughput = ThroughputController(context).getInstance();
throughput.setConfig({ settings, playbackController: playback });
throughput.initialize();
const history = SwitchRequestHistory(context).create();
const rules = Collection(context).create({
  dashMetrics: metrics, mediaPlayerModel: player, settings, customParametersModel: { getAbrCustomRules: () => [] },
});

function rulesContext(currentRequest) {
  return RulesContext(context).create({
    abrController: abr,
    throughputController: throughput,
    switchRequestHistory: history,
    droppedFramesHistory: { getFrameHistory: () => null },
    currentRequest,
    videoModel: { getPlaybackRate: () => 1 },
    streamProcessor: {
      getScheduleController: () => ({
        setTimeToLoadDelay: (ms) => { delay = ms / 1000; },
        getPlaybackController: () => playback,
      }),
      getRepresentation: () => current,
    },
  });
}

function begin(question) {
  gopSeconds = question.gop_seconds;
  representations = question.bitrates.map((bandwidth, index) => ({
    id: String(index), index, absoluteIndex: index, bandwidth, bitrateInKbit: bandwidth / 1000, mediaInfo: media,
    fragmentDuration: gopSeconds,
  }));
  current = abr.getOptimalRepresentationForBitrate(media, FIRST_KBIT);
  rules.initialize();
  rules.setBolaState('video', strategy === 'bola');
  return {};
}

// What happens in a player when a segment has come.
function loaded({ sent, latency, duration, bytes }, gop) {
  const end = sent + latency + duration;
  lastRequest = {
    type: 'MediaSegment', url: String(gop), _streamId: stream.id, trequest: date(sent), tresponse: date(sent + latency),
    _tfinish: date(end), _resourceTimingValues: {
      transferSize: bytes, decodedBodySize: bytes, responseStart: 1000 * (sent + latency), responseEnd: 1000 * end },
    trace: [{ d: 1000 * latency, b: [0] }, { d: 1000 * duration, b: [bytes] }],
  };
  bus.trigger(PlayerEvents.METRIC_ADDED, { metric: 'HttpList', mediaType: 'video', value: lastRequest });
  const chunk = { representation: current, start: gop * gopSeconds, duration: gopSeconds };
  bus.trigger(Events.MEDIA_FRAGMENT_LOADED, { streamId: stream.id, chunk });
  bus.trigger(Events.BYTES_APPENDED_END_FRAGMENT, { startTime: gop * gopSeconds, mediaType: 'video' });
}

// Dynamic changes from throughput to BOLA when the buffer is full, and back when it is half empty, as AbrController does.
function changeStrategy() {
  if (strategy === 'dynamic') {
    const full = player.getBufferTimeDefault();
    rules.setBolaState('video', buffer >= (rules.getBolaState('video') ? 0.5 * full : full));
  }
}

function change(to) {
  if (to && to.id !== current.id) {
    current = to;
    bus.trigger(PlayerEvents.QUALITY_CHANGE_REQUESTED, { streamId: stream.id, mediaType: 'video', newRepresentation: to });
  }
}

function pick(question) {
  progress = null;
  delay = 0;
  if (buffer === 0 && question.gop > 0) {
    bus.trigger(PlayerEvents.BUFFER_EMPTY, { mediaType: 'video', streamId: stream.id });
  }
  if (question.transfer) loaded(question.transfer, question.gop - 1);
  changeStrategy();
  if (question.gop > 0) {
    const to = rules.getBestPossibleSwitchRequest(rulesContext(null)).representation;
    history.push({ currentRepresentation: current, newRepresentation: to ?? current });
    change(to);
  }
  return { rung: current.absoluteIndex, wait: delay };
}

function watch({ gop, request }) {
  if (progress?.gop !== gop) progress = { gop, traces: [], bytes: 0, last: request.sent };
  if (request.received === 0) return {};
  progress.traces.push({ d: 1000 * (now - progress.last), b: [request.received - progress.bytes] });
  Object.assign(progress, { bytes: request.received, last: now });
  const to = rules.shouldAbandonFragment(rulesContext({
    index: gop, firstByteDate: date(request.first), traces: progress.traces, bytesLoaded: request.received,
    bytesTotal: request.bytes, duration: gopSeconds, representation: current,
  })).representation;
  if (!to) return {};
  abandonedUntil = now + ABANDONED_SECONDS;
  change(to);
  bus.trigger(PlayerEvents.FRAGMENT_LOADING_ABANDONED, { streamId: stream.id, mediaType: 'video' });
  return { rung: to.absoluteIndex };
}

const answers = { begin, pick, progress: watch };
for await (const line of createInterface({ input: process.stdin })) {
  const question = JSON.parse(line);
  now = question.now ?? now;
  buffer = question.buffer ?? buffer;
  process.stdout.write(JSON.stringify(answers[question.ask](question)) + '\n');
}
