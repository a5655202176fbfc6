// The robot of the part's view: where its joints are, and bodies around them, its cutter and the arrow of the force.
// Poses are rows of 3 x 4 numbers, lengths in mm; bodies are drawn around the joints' axes, they are not measured.

const SEGMENTS = 28, FLOATS = 9;
const RINGS = [0, 0.25, 0.5, 0.75, 1].map((share) => (share * Math.PI) / 2);

const times = (a, b) => {
  const c = new Array(12);
  for (let i = 0; i < 3; i++) {
    for (let k = 0; k < 4; k++) {
      c[4 * i + k] = a[4 * i] * b[k] + a[4 * i + 1] * b[4 + k] + a[4 * i + 2] * b[8 + k] + (k === 3 ? a[4 * i + 3] : 0);
    }
  }
  return c;
};
const origin = (pose) => [pose[3], pose[7], pose[11]];
const zAxis = (pose) => [pose[2], pose[6], pose[10]];
const placedAt = (pose, p) => [0, 1, 2].map((i) => pose[4 * i] * p[0] + pose[4 * i + 1] * p[1] + pose[4 * i + 2] * p[2] + pose[4 * i + 3]);
const turnedBy = (pose, v) => [0, 1, 2].map((i) => pose[4 * i] * v[0] + pose[4 * i + 1] * v[1] + pose[4 * i + 2] * v[2]);
const plus = (a, b, by = 1) => [a[0] + by * b[0], a[1] + by * b[1], a[2] + by * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const across = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const size = Math.hypot(...a) || 1; return a.map((value) => value / size); };

// The frames after each joint and the flange, with the base of the robot at `base` and joint values [rad, mm].
function jointFrames(chain, base, values) {
  let at = base;
  const frames = chain.joints.map(({ placement, turns, follows }) => {
    const value = follows.reduce((sum, [column, ratio]) => sum + ratio * values[column], 0);
    const [c, s] = [Math.cos(value), Math.sin(value)];
    at = times(times(at, placement), turns ? [c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0] : [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, value]);
    return at;
  });
  return { frames, flange: times(at, chain.flange) };
}

// Triangles with their normals and colours.
class Bodies {
  constructor() { this.numbers = []; }

  // A body of revolution: `profile` of [height, radius] along `axis` from `from`.
  lathe(from, axis, profile, colour) {
    const e1 = unit(across(axis, Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])), e2 = across(axis, e1);
    const point = ([z, r], c, s) => [0, 1, 2].map((k) => from[k] + z * axis[k] + r * (c * e1[k] + s * e2[k]));
    for (let at = 1; at < profile.length; at++) {
      const [low, high] = [profile[at - 1], profile[at]];
      const [dz, dr] = [high[0] - low[0], high[1] - low[1]], long = Math.hypot(dz, dr);
      if (long < 1e-9) continue;
      for (let k = 0; k < SEGMENTS; k++) {
        const corners = [k, k + 1].map((step) => {
          const [c, s] = [Math.cos((2 * Math.PI * step) / SEGMENTS), Math.sin((2 * Math.PI * step) / SEGMENTS)];
          const normal = [0, 1, 2].map((i) => ((c * e1[i] + s * e2[i]) * dz - axis[i] * dr) / long);
          return [[...point(low, c, s), ...normal, ...colour], [...point(high, c, s), ...normal, ...colour]];
        });
        for (const [side, end] of [[0, 0], [0, 1], [1, 0], [1, 0], [0, 1], [1, 1]]) this.numbers.push(...corners[side][end]);
      }
    }
  }

  // A cylinder or cone with round ends.
  capsule(from, to, r0, r1, colour) {
    const step = plus(to, from, -1), long = Math.hypot(...step);
    const axis = long > 1e-6 ? unit(step) : [0, 0, 1];
    const profile = [
      ...RINGS.map((turn) => [-r0 * Math.cos(turn), r0 * Math.sin(turn)]),
      ...RINGS.map((turn) => [long + r1 * Math.sin(turn), r1 * Math.cos(turn)]),
    ];
    this.lathe(from, axis, profile, colour);
  }

  drum(middle, axis, half, radius, colour) {
    this.lathe(plus(middle, axis, -half), axis, [[0, 0], [0, radius], [2 * half, radius], [2 * half, 0]], colour);
  }

  // Shaft and head, from `tail` to `tip`.
  arrow(tail, tip, radius, colour) {
    const step = plus(tip, tail, -1), long = Math.hypot(...step);
    const neck = Math.max(0, long - 5 * radius);
    this.lathe(tail, unit(step), [[0, 0], [0, radius], [neck, radius], [neck, 2.4 * radius], [long, 0]], colour);
  }

  box(half, colour) {
    for (let k = 0; k < 3; k++) {
      for (const end of [-1, 1]) {
        const at = (a, b) => {
          const place = [0, 0, 0];
          [place[k], place[(k + 1) % 3], place[(k + 2) % 3]] = [end * half[k], a * half[(k + 1) % 3], b * half[(k + 2) % 3]];
          return [...place, ...[0, 1, 2].map((i) => (i === k ? end : 0)), ...colour];
        };
        for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) this.numbers.push(...at(a, b));
      }
    }
  }

  get count() { return this.numbers.length / FLOATS; }
}

const LINK = [0.62, 0.65, 0.69], DRUM = [0.42, 0.45, 0.5], STEEL = [0.84, 0.8, 0.62], HELD = [0.5, 0.52, 0.55];

// The robot at `values`; each link goes along the axis of its joint first, then to the next joint.  Its flange.
function drawRobot(bodies, chain, base, values) {
  const { frames, flange } = jointFrames(chain, base, values);
  const places = [origin(base)];
  frames.forEach((frame, i) => {
    const next = i + 1 < frames.length ? origin(frames[i + 1]) : origin(flange);
    const at = origin(frame), axis = zAxis(frame);
    places.push(at, plus(at, axis, dot(plus(next, at, -1), axis)), next);
  });
  const steps = places.slice(1).map((place, i) => Math.hypot(...plus(place, places[i], -1)));
  const size = steps.reduce((sum, step) => sum + step, 0);
  const radius = (done) => size * (0.047 - 0.03 * Math.min(1, done / size));
  let done = 0;
  bodies.lathe(origin(base), zAxis(base), [[-1, 0], [-1, 1.7], [-0.6, 1.7], [-0.4, 1.1], [0, 1]].map(([z, r]) => [z * radius(0), r * radius(0)]), DRUM);
  const drums = [];
  steps.forEach((step, i) => {
    if (i % 3 === 1) drums.push([(i - 1) / 3, radius(done)]);
    if (step > 1e-3) bodies.capsule(places[i], places[i + 1], radius(done), radius(done + step), LINK);
    done += step;
  });
  for (const [joint, r] of drums) {
    if (chain.joints[joint].turns) bodies.drum(origin(frames[joint]), zAxis(frames[joint]), 1.12 * r, 1.12 * r, DRUM);
  }
  bodies.thin = radius(size);
  return flange;
}

// The cutter with its tip at `tip`, and what holds it, as far as the flange where that is known.
function drawTool(bodies, profile, tip, axis, flange) {
  let top = 0;
  for (let at = 1; at < profile.length; at++) {
    const [part, z, r] = profile[at];
    const before = profile[at - 1][0] === part ? profile[at - 1].slice(1) : [z, r];
    bodies.lathe(tip, axis, [before, [z, r]], part === 0 ? STEEL : HELD);
    top = z;
  }
  if (!profile.length) return;
  const wide = profile[profile.length - 1][2];
  bodies.lathe(tip, axis, [[top, wide], [top, 0]], HELD);
  if (flange) {
    const nose = Math.max(1.3 * wide, 0.6 * bodies.thin), from = plus(tip, axis, top);
    const height = Math.max(0, dot(plus(origin(flange), tip, -1), axis) - top);
    bodies.lathe(from, axis, [[0, 0], [0, nose], [height, nose], [height, 0]], HELD);
    bodies.capsule(plus(from, axis, height), origin(flange), nose, nose, HELD);
  }
}
