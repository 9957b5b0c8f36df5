// SPDX-License-Identifier: MIT OR Apache-2.0
// Lines and faces in three dimensions, by WebGL alone: an orthographic view about the z axis.

const SHADERS = [
  `attribute vec3 at; attribute vec3 normal; uniform mat3 turn; uniform vec3 frame; varying float shade;
   void main() {
     vec3 p = turn * vec3(at.xy, at.z - frame.z);
     float facing = length(normal) > 0.0 ? abs((turn * normal).z) : 1.0;
     shade = 0.55 + 0.45 * facing;
     gl_Position = vec4(p.x / frame.x, p.y / frame.y, -0.2 * p.z / frame.y, 1.0);
   }`,
  `precision mediump float; uniform vec4 paint; varying float shade;
   void main() { gl_FragColor = vec4(paint.rgb * shade * paint.a, paint.a); }`,
];

// A view into `canvas`, or null where there is no WebGL.
function viewOf(canvas) {
  const gl = canvas.getContext("webgl", { antialias: true, premultipliedAlpha: true, preserveDrawingBuffer: true });
  if (!gl) return null;
  const program = gl.createProgram();
  SHADERS.forEach((source, i) => {
    const shader = gl.createShader(i ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  });
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
  gl.useProgram(program);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  const [at, normal] = ["at", "normal"].map((name) => gl.getAttribLocation(program, name));
  const [turn, frame, paint] = ["turn", "frame", "paint"].map((name) => gl.getUniformLocation(program, name));
  gl.enableVertexAttribArray(at);

  // Points of lines in pairs, or of triangles with their normals.
  const mesh = (kind, points, normals) => {
    const buffer = (list) => {
      const made = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, made);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(list), gl.STATIC_DRAW);
      return made;
    };
    return { kind, count: points.length / 3, at: buffer(points), normal: normals ? buffer(normals) : null };
  };
  const forget = (old) => [old.at, old.normal].forEach((buffer) => buffer && gl.deleteBuffer(buffer));

  // Draws meshes in order, each with its colour: [red, green, blue, opacity] from 0 to 1.
  const draw = ({ azimuth, elevation, radius, middle }, parts) => {
    const [width, height] = [canvas.width, canvas.height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    const [s, c, v, h] = [Math.sin(azimuth), Math.cos(azimuth), Math.sin(elevation), Math.cos(elevation)];
    gl.uniformMatrix3fv(turn, false, [-s, -c * v, c * h, c, -s * v, s * h, 0, h, v]);
    const least = Math.min(width, height);
    gl.uniform3f(frame, (radius * width) / least, (radius * height) / least, middle);
    for (const [part, colour] of parts) {
      gl.uniform4fv(paint, colour);
      gl.bindBuffer(gl.ARRAY_BUFFER, part.at);
      gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 0, 0);
      if (part.normal) {
        gl.bindBuffer(gl.ARRAY_BUFFER, part.normal);
        gl.enableVertexAttribArray(normal);
        gl.vertexAttribPointer(normal, 3, gl.FLOAT, false, 0, 0);
      } else {
        gl.disableVertexAttribArray(normal);
        gl.vertexAttrib3f(normal, 0, 0, 0);
      }
      gl.drawArrays(part.kind === "lines" ? gl.LINES : gl.TRIANGLES, 0, part.count);
    }
  };
  return { mesh, forget, draw };
}

// The surface that a line of (r, z) makes about the z axis: triangles and normals.
function revolved(line, around = 64) {
  const [points, normals] = [[], []];
  const on = ([r, z], k) => [r * Math.cos((2 * Math.PI * k) / around), r * Math.sin((2 * Math.PI * k) / around), z];
  for (let i = 0; i + 1 < line.length; i += 1) {
    const [a, b] = [line[i], line[i + 1]];
    const size = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
    const n = [(a[1] - b[1]) / size, (b[0] - a[0]) / size];
    for (let k = 0; k < around; k += 1) {
      for (const [p, q] of [[a, k], [b, k], [a, k + 1], [a, k + 1], [b, k], [b, k + 1]]) {
        points.push(...on(p, q));
        normals.push(...on([n[0], n[1]], q));
      }
    }
  }
  return [points, normals];
}

// A circle about the z axis, as lines.
function circle(r, z, around = 96) {
  const at = (k) => [r * Math.cos((2 * Math.PI * k) / around), r * Math.sin((2 * Math.PI * k) / around), z];
  return Array.from({ length: around }, (_, k) => [...at(k), ...at(k + 1)]).flat();
}

// The twelve edges of a box, as lines.
function edges([low, high]) {
  const at = (k) => [0, 1, 2].map((i) => ((k >> i) & 1 ? high : low)[i]);
  const list = [];
  for (let k = 0; k < 8; k += 1) for (let i = 0; i < 3; i += 1) if (!((k >> i) & 1)) list.push(...at(k), ...at(k | (1 << i)));
  return list;
}

// The six faces of a box with these corners, bit i of their numbers low or high along its axis i: triangles and normals.
function faces(corners) {
  const [points, normals] = [[], []];
  for (let i = 0; i < 3; i += 1) {
    const [j, k] = [(i + 1) % 3, (i + 2) % 3];
    for (const end of [0, 1]) {
      const corner = (a, b) => corners[(end << i) | (a << j) | (b << k)];
      const [u, v] = [corner(1, 0), corner(0, 1)].map((p) => p.map((x, axis) => x - corner(0, 0)[axis]));
      const normal = [0, 1, 2].map((axis) => u[(axis + 1) % 3] * v[(axis + 2) % 3] - u[(axis + 2) % 3] * v[(axis + 1) % 3]);
      const length = Math.hypot(...normal);
      for (const [a, b] of [[0, 0], [1, 0], [0, 1], [0, 1], [1, 0], [1, 1]]) {
        points.push(...corner(a, b));
        normals.push(...normal.map((x) => x / length));
      }
    }
  }
  return [points, normals];
}
