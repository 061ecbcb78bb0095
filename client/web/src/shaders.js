// Programs that make surfaces of 16 bytes each: cell, height, depth, colour.
//
// A face is one triangle that reaches beyond the face's square, and the fragments out there are
// discarded: on a machine without a card triangles and vertices are what costs, not pixels. A level
// surface has one face, a wall the three of a box that the eye can see (WALLS), or, far away, one
// from its upper edge behind to its lower edge before, which has the outline of the box (FAR).

export const VERTEX = `
uniform highp isampler2D data; uniform vec2 origin; uniform float size, cut, bottom, greySides; uniform mat4 toScreen; uniform vec3 eye;
flat out vec3 colour; out vec2 at;
#ifdef FAR
flat out float top; // share of the face that is the box's upper one
#endif
#ifdef PICK
flat out float kind; out vec3 world;
#else
vec3 world;
#endif
void main() {
#if defined(WALLS) && !defined(FAR)
  const int per = 9;
#else
  const int per = 3;
#endif
  int i = int((float(gl_VertexID) + .5) * (1. / float(per))), v = gl_VertexID - i * per;
  ivec4 d = texelFetch(data, ivec2(i & 255, i >> 8), 0);
  float z = float(d.y) * (1. / 512.);
  vec2 cell = origin + vec2(d.x & 255, (d.x >> 8) & 255) * size;
  colour = vec3(d.w & 255, (d.w >> 8) & 255, (d.w >> 16) & 255) * (1. / 255.);
#ifdef WALLS
  float depth = float(d.z) * (1. / 512.);
  vec2 middle = cell + .5 * size;
#ifdef FAR
  at = vec2(v == 1 ? 2. : 0., v == 2 ? 2. : 0.);
  vec2 before = (eye.xy - middle) * inversesqrt(dot(eye.xy - middle, eye.xy - middle) + 1e-6) * size;
  vec2 across = vec2(-before.y, before.x) * (at.x - .5);
  world = vec3(middle + across + before * (eye.z > z - .5 * depth ? at.y - .5 : .5 - at.y), z - at.y * depth);
  vec2 upper = vec2(size * max(eye.z - z, 0.), depth * length(eye.xy - middle));
  top = upper.x / (upper.x + upper.y + 1e-6);
#else
  int face = v / 3;
  v -= face * 3;
  at = vec2(v == 1 ? 2. : 0., v == 2 ? 2. : 0.);
  vec2 near = vec2(greaterThan(eye.xy, middle)) * size;
  if (face == 0) world = vec3(cell + at * size, eye.z < z - depth ? z - depth : z);
  else {
    if (greySides > 0.) colour = vec3(.45, .43, .42);
    colour *= face == 1 ? .66 : .82;
    world = vec3(cell + (face == 1 ? vec2(at.x * size, near.y) : vec2(near.x, at.x * size)), z - at.y * depth);
  }
#endif
#else
  at = vec2(v == 1 ? 2. : 0., v == 2 ? 2. : 0.);
  world = vec3(cell + at * size, z);
#endif
#ifdef PICK
  kind = float((d.x >> 16) & 3);
#endif
  gl_Position = z > cut || z < bottom ? vec4(2., 2., 2., 1.) : toScreen * vec4(world, 1.);
}`;

// A little beyond the square, or neighbours might leave a line between them.
export const FRAGMENT = `
flat in vec3 colour; in vec2 at; out vec4 result;
#ifdef FAR
flat in float top;
#endif
#ifdef PICK
flat in float kind; in vec3 world;
#endif
void main() {
  if (max(at.x, at.y) > 1.001) discard;
#ifdef PICK
  result = vec4(world, kind + 1.);
#elif defined(FAR)
  result = vec4(at.y < top ? colour : colour * .74, 1.);
#else
  result = vec4(colour, 1.);
#endif
}`;
