// CPU seconds of this process, all threads.
import { createInterface } from 'node:readline';

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

// Does what each line of standard input names, and answers with a line of JSON: what that gives, and the seconds it took.
export async function serve(works) {
  for await (const name of createInterface({ input: process.stdin })) {
    const [begin, wall] = [seconds(), performance.now()];
    const result = await works[name]();
    const cpu_s = seconds() - begin;
    console.log(JSON.stringify({ ...result, cpu_s, wall_s: (performance.now() - wall) / 1000 }));
  }
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
