// `splatstream serve`, of which tests need the address.
import { spawn } from 'node:child_process';

/** A folder served by the command with some options: its process, and the address it prints. What else it prints is an error. */
export async function serving(folder, ...options) {
  const server = spawn(process.env.SPLATSTREAM, ['serve', folder, '--port', '0', ...options], { stdio: ['ignore', 'ignore', 'pipe'] });
  let said = '';
  const address = await new Promise((resolve, reject) => {
    server.stderr.on('data', (data) => {
      said += data;
      const found = /http:\S+(?=\n)/.exec(said);
      if (found) resolve(found[0]);
    });
    server.once('error', reject);
    // Not at its exit: what it said may still be under way then.
    server.once('close', (status) => reject(new Error(`serve ended with ${status}: ${said}`)));
  });
  return { server, address };
}
