// CPU seconds of this process, all threads.
const SLOW = 60; // seconds: what takes longer is not repeated

// [the last result of work, the median of its seconds]
export async function timed(repeat, work) {
  const runs = [];
  let result;
  do {
    const begin = seconds();
    result = await work();
    runs.push(seconds() - begin);
  } while (runs.length < repeat && runs.at(-1) <= SLOW);
  return [result, median(runs)];
}

function seconds() {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1e6;
}

function median(values) {
  const sorted = [...values].sort((a, b) => a - b);
  const middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
}
