// decades.js - ticks of a logarithmic axis as powers of ten, as in axis.py; a deep zoom has those of the numbers.
function decades([lo, hi]) {
  const found = [], between = hi - lo < 2.5 ? [1, 2, 5] : [1];
  for (let k = Math.floor(lo); k < hi; k++) for (const m of between) found.push(k + Math.log10(m));
  const inside = found.filter(v => v >= lo && v <= hi);
  return inside.length > 1 ? inside : ticks([10 ** lo, 10 ** hi]).map(Math.log10);
}
