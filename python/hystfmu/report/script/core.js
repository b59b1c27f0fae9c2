// core.js - a graph of blocks in the C core; fmu_build/platforms/page.c has its functions.
const STATUS = ['ok', 'damaged block file', 'version of the block file', 'checksum of the block file', 'unknown block',
  'size out of range', 'value out of range', 'parameters that do not fit together', 'unknown port', 'algebraic loop',
  'no root of the implicit inverse', 'out of memory']; // HYST_ERRORS

const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));

async function load(packed) {
  const stream = new Blob([bytes(packed)]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
  return (await WebAssembly.instantiate(await new Response(stream).arrayBuffer(), {})).instance.exports;
}

function graph(core, {file, u, y}) {
  const numbers = at => new Float64Array(core.memory.buffer, at); // made anew: the memory may have grown
  const text = at => new TextDecoder().decode(new Uint8Array(core.memory.buffer, at, 192)).split('\0')[0];
  const content = bytes(file), room = core.room(content.length);
  if (room) new Uint8Array(core.memory.buffer, room, content.length).set(content);
  const g = room && core.open(room, content.length);
  const check = status => {
    const told = [STATUS[status], ...['place', 'variable', 'rule'].map(k => text(core[k](g)))];
    if (status) throw Error(told.filter(s => s).join(': '));
  };
  if (!g) throw Error('a model cannot be opened');
  let row = 0;
  return {
    set: (reference, v) => check(core.set(g, reference, v)),
    defaults: () => core.defaults(g),
    restart: () => row = 0,
    rest: () => check(core.rest(g)),
    state: node => numbers(core.state(g, node)),
    values: (reference, size) => Array.from({length: size}, (_, k) => numbers(core.value(g, reference + k))[0]),
    // the output for the next input, with the times of a run: row 0 starts, row k steps to (k - 1) h + h
    next(value, h) {
      check(core.set(g, u, value));
      check(row ? core.step(g, (row - 1) * h + h, h) : core.start(g, 0));
      row++;
      return numbers(core.value(g, y))[0];
    },
  };
}
