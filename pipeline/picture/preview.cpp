// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/picture/preview.h"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <numbers>
#include <system_error>
#include <thread>
#include <vector>

#include "geometry/error.h"
#include "pipeline/picture/colour_scale.h"
#include "pipeline/picture/image.h"

namespace toile {

namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr float infinity = std::numeric_limits<float>::infinity();

// Work on items 0..count-1, each on its own, so that the number of threads can't show in the result. Where items throw,
// the others are still done, and the exception of the lowest one comes out.
void for_all(int count, const std::function<void(int)>& work) {
  const int threads = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 16);
  std::atomic<int> next{0};
  std::mutex mutex;  // of the two below
  int failed = count;
  std::exception_ptr error;
  const auto attempt = [&](int k) {
    try {
      work(k);
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (k < failed) failed = k, error = std::current_exception();
    }
  };
  const auto run = [&] {
    constexpr int chunk = 8;
    for (int first = next.fetch_add(chunk); first < count; first = next.fetch_add(chunk))
      for (int k = first; k < std::min(first + chunk, count); ++k) attempt(k);
  };
  {
    std::vector<std::jthread> helpers;
    try {
      for (int k = 1; k < threads; ++k) helpers.emplace_back(run);
    } catch (const std::system_error&) {  // fewer threads then
    }
    run();
  }
  if (error) std::rethrow_exception(error);
}

// ---- the cloth -----------------------------------------------------------------------------------------------------

struct Face {
  std::array<int, 3> vertex;
  int panel = 0;                  // -1: of a body
  std::array<bool, 3> border{};   // edge opposite to vertex k belongs to no other triangle
  Vector2f metres_per_parameter;  // distance in space per change of u and v at right angles to the iso-lines
};

struct Cloth {
  std::vector<Vector3f> x, normal;
  std::vector<Vector2f> uv;
  std::vector<float> value;
  std::vector<Face> triangles;
  std::vector<std::array<std::vector<float>, 2>> knots;  // per panel
  bool valued = true;
  Vector3d centre;
  float radius = 0;
  std::vector<Vector3f> framed;  // what the picture shows whole: the cloth, and bodies next to it
};

void mark_borders(Cloth& cloth, std::size_t first) {
  struct Edge {
    int a, b, triangle, corner;
  };
  std::vector<Edge> edges;
  for (std::size_t t = first; t < cloth.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const auto& v = cloth.triangles[t].vertex;
      const int a = v[static_cast<std::size_t>((k + 1) % 3)], b = v[static_cast<std::size_t>((k + 2) % 3)];
      edges.push_back({std::min(a, b), std::max(a, b), static_cast<int>(t), k});
    }
  std::sort(edges.begin(), edges.end(), [](const Edge& l, const Edge& r) {
    return std::tie(l.a, l.b, l.triangle) < std::tie(r.a, r.b, r.triangle);
  });
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const auto same = [&](std::size_t other) { return edges[other].a == edges[k].a && edges[other].b == edges[k].b; };
    if ((k == 0 || !same(k - 1)) && (k + 1 == edges.size() || !same(k + 1)))
      cloth.triangles[static_cast<std::size_t>(edges[k].triangle)].border[static_cast<std::size_t>(edges[k].corner)] =
          true;
  }
}

Cloth gather(const Frame& frame) {
  Cloth cloth;
  Eigen::AlignedBox3d box;
  std::vector<Vector3d> places;
  for (const FramePanel& panel : frame.panels) {
    const std::size_t first_vertex = cloth.uv.size(), first_triangle = cloth.triangles.size();
    for (const Eigen::Vector2d& p : panel.triangles->uv) {
      const SurfaceJet jet = evaluate(*panel.surface, p[0], p[1]);
      places.push_back(jet.x);
      box.extend(jet.x);
      cloth.normal.push_back(jet.u.cross(jet.v).stableNormalized().cast<float>());
      cloth.uv.push_back(p.cast<float>());
    }
    const auto& strain = panel.fields.strain;
    cloth.valued = cloth.valued && strain.size() == panel.triangles->uv.size();
    for (const Vector3d& e : strain) cloth.value.push_back(static_cast<float>(std::max(e[0], e[1])));
    for (const auto& t : panel.triangles->triangles) {
      Face triangle;
      for (std::size_t k = 0; k < 3; ++k) triangle.vertex[k] = static_cast<int>(first_vertex) + t[k];
      triangle.panel = static_cast<int>(cloth.knots.size());
      cloth.triangles.push_back(triangle);
    }
    std::array<std::vector<float>, 2> knots;
    for (std::size_t d = 0; d < 2; ++d)
      for (const double k : panel.surface->knots(d == 0 ? Direction::u : Direction::v).breaks())
        knots[d].push_back(static_cast<float>(k));
    cloth.knots.push_back(std::move(knots));
    mark_borders(cloth, first_triangle);
  }
  for (const float value : cloth.value)
    if (!std::isfinite(value)) throw OutputError("preview: the frame's strains are not finite");
  if (cloth.triangles.empty()) throw OutputError("preview: the frame has no cloth to draw");
  if (!(box.sizes().norm() < 1e30)) throw OutputError("preview: the frame's positions are not finite");
  const std::size_t of_cloth = places.size();
  Eigen::AlignedBox3d near = box;  // a body is framed as far as it is beside the cloth
  near.min() -= 0.15 * box.sizes();
  near.max() += 0.15 * box.sizes();
  for (const FrameBody& body : frame.bodies) {
    const std::size_t first = places.size();
    Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, body.mesh.vertices.cols());
    for (const auto& t : body.mesh.triangles) {
      const auto at = [&](int k) -> Vector3d { return body.mesh.vertices.col(t[static_cast<std::size_t>(k)]); };
      const Vector3d normal = (at(1) - at(0)).cross(at(2) - at(0));
      Face face;
      face.panel = -1;
      for (std::size_t k = 0; k < 3; ++k) {
        face.vertex[k] = static_cast<int>(first) + t[k];
        normals.col(t[k]) += normal;
      }
      cloth.triangles.push_back(face);
    }
    for (Eigen::Index k = 0; k < normals.cols(); ++k) {
      places.push_back(body.mesh.vertices.col(k));
      cloth.normal.push_back(normals.col(k).stableNormalized().cast<float>());
      cloth.uv.emplace_back(0.0f, 0.0f);
    }
  }
  // Centred, so that single precision serves.
  cloth.centre = box.center();
  cloth.radius = static_cast<float>(std::max(box.sizes().norm() / 2, 1e-12));
  for (const Vector3d& x : places) {
    cloth.x.push_back((x - cloth.centre).cast<float>());
    if (cloth.x.size() <= of_cloth || near.contains(x)) cloth.framed.push_back(cloth.x.back());
  }
  for (Face& triangle : cloth.triangles) {
    if (triangle.panel < 0) continue;
    const auto [a, b, c] = triangle.vertex;
    const auto at = [](int k) { return static_cast<std::size_t>(k); };
    // Gradients of u and v in the triangle's plane.
    Eigen::Matrix<float, 3, 2> e;
    e << cloth.x[at(b)] - cloth.x[at(a)], cloth.x[at(c)] - cloth.x[at(a)];
    Eigen::Matrix2f d;
    d << cloth.uv[at(b)] - cloth.uv[at(a)], cloth.uv[at(c)] - cloth.uv[at(a)];
    const Eigen::Matrix<float, 3, 2> gradient = e * (e.transpose() * e).inverse() * d.transpose();
    for (int k = 0; k < 2; ++k) triangle.metres_per_parameter[k] = 1 / gradient.col(k).norm();
  }
  return cloth;
}

// ---- rays ----------------------------------------------------------------------------------------------------------

struct Hit {
  float distance = infinity;
  unsigned triangle = RTC_INVALID_GEOMETRY_ID;
  float b = 0, c = 0;  // weights of the second and third vertex
  explicit operator bool() const { return triangle != RTC_INVALID_GEOMETRY_ID; }
};

class Rays {
 public:
  // One thread builds the tree: the same tree each time. Robust: no ray slips between triangles.
  explicit Rays(const Cloth& cloth) : device_(rtcNewDevice("threads=1,user_threads=1,set_affinity=0")) {
    if (!device_) throw OutputError("preview: Embree does not start on this machine");
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* x = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                          3 * sizeof(float), cloth.x.size()));
    auto* index = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                 3 * sizeof(unsigned), cloth.triangles.size()));
    if (!x || !index) throw OutputError("preview: not enough memory for the picture");
    for (const Vector3f& p : cloth.x) x = std::copy_n(p.data(), 3, x);
    for (const Face& t : cloth.triangles)
      for (const int vertex : t.vertex) *index++ = static_cast<unsigned>(vertex);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  ~Rays() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  Rays(const Rays&) = delete;
  Rays& operator=(const Rays&) = delete;

  Hit nearest(const Vector3f& from, const Vector3f& direction) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    RTCRayHit query{};
    set(query.ray, from, direction, infinity);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_, &context, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
    return {query.ray.tfar, query.hit.primID, query.hit.u, query.hit.v};
  }

  bool blocked(const Vector3f& from, const Vector3f& direction, float length) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay ray{};
    set(ray, from, direction, length);
    rtcOccluded1(scene_, &context, &ray);
    return ray.tfar < 0;
  }

 private:
  static void set(RTCRay& ray, const Vector3f& from, const Vector3f& direction, float length) {
    ray.org_x = from[0], ray.org_y = from[1], ray.org_z = from[2];
    ray.dir_x = direction[0], ray.dir_y = direction[1], ray.dir_z = direction[2];
    ray.tnear = 0;
    ray.tfar = length;
    ray.mask = ~0u;
  }

  RTCDevice device_;
  RTCScene scene_ = nullptr;
};

// ---- light ---------------------------------------------------------------------------------------------------------

// Two vectors at right angles to a unit vector and each other. [Duff et al. 2017]
std::pair<Vector3f, Vector3f> frame_of(const Vector3f& n) {
  const float sign = std::copysign(1.0f, n[2]);
  const float a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
  return {{1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]}, {b, sign + n[1] * n[1] * a, -n[1]}};
}

// The k-th of `count` points of the Hammersley set in the unit square.
Vector2f hammersley(unsigned k, unsigned count) {
  unsigned bits = k;
  bits = (bits << 16) | (bits >> 16);
  bits = ((bits & 0x55555555u) << 1) | ((bits & 0xAAAAAAAAu) >> 1);
  bits = ((bits & 0x33333333u) << 2) | ((bits & 0xCCCCCCCCu) >> 2);
  bits = ((bits & 0x0F0F0F0Fu) << 4) | ((bits & 0xF0F0F0F0u) >> 4);
  bits = ((bits & 0x00FF00FFu) << 8) | ((bits & 0xFF00FF00u) >> 8);
  return {(static_cast<float>(k) + 0.5f) / static_cast<float>(count), static_cast<float>(bits) * 0x1p-32f};
}

// Directions about +z: cosine weighted over the hemisphere, or within a cone.
std::vector<Vector3f> hemisphere_directions(unsigned count) {
  std::vector<Vector3f> out;
  for (unsigned k = 0; k < count; ++k) {
    const Vector2f s = hammersley(k, count);
    const float r = std::sqrt(s[0]), angle = 2 * std::numbers::pi_v<float> * s[1];
    out.emplace_back(r * std::cos(angle), r * std::sin(angle), std::sqrt(1 - s[0]));
  }
  return out;
}
std::vector<Vector3f> cone_directions(unsigned count, float tangent) {
  std::vector<Vector3f> out;
  for (unsigned k = 0; k < count; ++k) {
    const Vector2f s = hammersley(k, count);
    const float r = tangent * std::sqrt(s[0]), angle = 2 * std::numbers::pi_v<float> * s[1];
    out.push_back(Vector3f(r * std::cos(angle), r * std::sin(angle), 1).normalized());
  }
  return out;
}

Vector3f turn(const std::pair<Vector3f, Vector3f>& frame, const Vector3f& n, const Vector3f& d) {
  return d[0] * frame.first + d[1] * frame.second + d[2] * n;
}

struct Light {
  float sky = 1;  // part of the hemisphere that sees no cloth nearby
  float key = 1;  // part of the lamp that is seen
};

class Lighting {
 public:
  Lighting(const Cloth& cloth, const Rays& rays, const Vector3f& key, unsigned sky_rays, unsigned key_rays)
      : rays_(rays),
        key_(key),
        radius_(cloth.radius),
        sky_(hemisphere_directions(sky_rays)),
        cone_(cone_directions(key_rays, 0.12f)) {
    const auto frame = frame_of(key);
    for (Vector3f& d : cone_) d = turn(frame, key, d);
  }

  Light at(const Vector3f& x, const Vector3f& normal) const {
    const auto frame = frame_of(normal);
    const Vector3f from = x + 2e-3f * radius_ * normal;
    int open = 0, lit = 0;
    for (const Vector3f& d : sky_) open += !rays_.blocked(from, turn(frame, normal, d), 0.7f * radius_);
    for (const Vector3f& d : cone_) lit += !rays_.blocked(from, d, 4 * radius_);
    return {static_cast<float>(open) / static_cast<float>(sky_.size()),
            static_cast<float>(lit) / static_cast<float>(cone_.size())};
  }
  const Vector3f& key() const { return key_; }

 private:
  const Rays& rays_;
  Vector3f key_;
  float radius_;
  std::vector<Vector3f> sky_, cone_;
};

// ---- camera --------------------------------------------------------------------------------------------------------

struct Camera {
  Vector3f place, right, up, back;   // unit axes; looks along -back
  float pixel = 0;                   // tangent per pixel
  float centre_x = 0, centre_y = 0;  // pixels
  Vector3f direction(float x, float y) const {
    return (pixel * (x - centre_x) * right - pixel * (y - centre_y) * up - back).normalized();
  }
};

Vector3f view_direction(const Cloth& cloth, const PreviewOptions& options, const Vector3f& up) {
  if (options.towards_camera && options.towards_camera->norm() > 0)
    return options.towards_camera->normalized().cast<float>();
  // Where the cloth shows the largest area; lower cameras are preferred, a hanging cloth is looked at from the side.
  const auto [a, b] = frame_of(up);
  const auto direction = [&, east = a, north = b](float azimuth, float elevation) -> Vector3f {
    return std::cos(elevation) * (std::cos(azimuth) * east + std::sin(azimuth) * north) + std::sin(elevation) * up;
  };
  constexpr float degree = std::numbers::pi_v<float> / 180;
  float best = -1, best_azimuth = 0, best_elevation = 0;
  for (const auto& [elevation, liking] : {std::pair{14 * degree, 1.0f}, {32 * degree, 0.93f}, {52 * degree, 0.85f}})
    for (int k = 0; k < 36; ++k) {
      const float azimuth = 10 * degree * static_cast<float>(k);
      const Vector3f d = direction(azimuth, elevation);
      float area = 0;
      for (const Face& t : cloth.triangles) {
        if (t.panel < 0) continue;
        const auto at = [&](int corner) {
          return cloth.x[static_cast<std::size_t>(t.vertex[static_cast<std::size_t>(corner)])];
        };
        area += std::abs((at(1) - at(0)).cross(at(2) - at(0)).dot(d));
      }
      // The margin keeps the choice clear of rounding where opposite views show the same.
      if (liking * area > 1.001f * best) best = liking * area, best_azimuth = azimuth, best_elevation = elevation;
    }
  // A little off the broadside, where folds show better.
  return direction(best_azimuth + 24 * degree, best_elevation);
}

struct Frustum {
  float left, right, top, bottom;  // pixels that the cloth may use
};

// The nearest place from which every point falls into the frustum: four planes, each touched by a point.
Camera fit_camera(const Cloth& cloth, const Vector3f& back, const Vector3f& up, const Frustum& window) {
  Camera camera;
  camera.back = back;
  Vector3f right = up.cross(back);
  if (right.norm() < 1e-3f) right = frame_of(back).first;
  camera.right = right.normalized();
  camera.up = back.cross(camera.right);
  camera.centre_x = (window.left + window.right) / 2;
  camera.centre_y = (window.top + window.bottom) / 2;
  const float half_x = (window.right - window.left) / 2, half_y = (window.bottom - window.top) / 2;
  constexpr float half_angle_tangent = 0.24f;  // a long lens
  camera.pixel = half_angle_tangent / std::max(half_x, half_y);
  const float tx = camera.pixel * half_x, ty = camera.pixel * half_y;
  float r = -infinity, l = -infinity, t = -infinity, b = -infinity, nearest = -infinity;
  for (const Vector3f& x : cloth.framed) {
    const float px = x.dot(camera.right), py = x.dot(camera.up), pz = x.dot(back);
    r = std::max(r, px + tx * pz), l = std::max(l, -px + tx * pz);
    t = std::max(t, py + ty * pz), b = std::max(b, -py + ty * pz);
    nearest = std::max(nearest, pz);
  }
  const float distance = std::max({(r + l) / (2 * tx), (t + b) / (2 * ty), nearest + 0.01f * cloth.radius});
  // Along the roomier axis the planes don't touch: keep the cloth in the middle.
  camera.place = (r - l) / 2 * camera.right + (t - b) / 2 * camera.up + distance * back;
  return camera;
}

// ---- pixels --------------------------------------------------------------------------------------------------------

const Vector3f ink(0.045f, 0.055f, 0.075f);

// Light on a plane under the cloth, on a grid about the origin.
class Ground {
 public:
  Ground(const Cloth& cloth, const Lighting& lighting, const Vector3f& up) : up_(up), axes_(frame_of(up)) {
    float low = infinity;
    for (const Vector3f& x : cloth.x) low = std::min(low, x.dot(up));
    height_ = low - 0.04f * cloth.radius;
    half_ = 1.9f * cloth.radius;
    light_.resize(static_cast<std::size_t>(cells * cells));
    for_all(cells * cells, [&](int k) {
      const auto place = [&](int i) { return half_ * (2 * (static_cast<float>(i) + 0.5f) / cells - 1); };
      light_[static_cast<std::size_t>(k)] =
          lighting.at(place(k % cells) * axes_.first + place(k / cells) * axes_.second + height_ * up_, up_);
    });
  }

  // How bright the ground is where a ray meets it, 1 in the open and where it doesn't.
  float brightness(const Vector3f& from, const Vector3f& direction) const {
    const float fall = direction.dot(up_);
    if (fall > -1e-4f) return 1;
    const float distance = (height_ - from.dot(up_)) / fall;
    if (distance <= 0) return 1;
    const Vector3f x = from + distance * direction;
    const float a = x.dot(axes_.first) / half_, b = x.dot(axes_.second) / half_;
    const float fade = 1 - a * a - b * b;
    if (fade <= 0) return 1;
    const auto [i, s] = cell(a);
    const auto [j, t] = cell(b);
    const auto shade = [&, i = i, j = j](int di, int dj) {
      const Light& l = light_[static_cast<std::size_t>((i + di) + cells * (j + dj))];
      return 0.34f * (1 - l.sky) + 0.17f * (1 - l.key);
    };
    const float dark =
        (1 - t) * ((1 - s) * shade(0, 0) + s * shade(1, 0)) + t * ((1 - s) * shade(0, 1) + s * shade(1, 1));
    return 1 - fade * dark;
  }

 private:
  static constexpr int cells = 80;
  static std::pair<int, float> cell(float a) {
    const float x = std::clamp((a + 1) / 2 * cells - 0.5f, 0.0f, cells - 1.001f);
    const int i = std::min(static_cast<int>(x), cells - 2);
    return {i, x - static_cast<float>(i)};
  }

  Vector3f up_;
  std::pair<Vector3f, Vector3f> axes_;
  float height_ = 0, half_ = 1;
  std::vector<Light> light_;
};

// Distance in space from a parameter to the nearest inner knot line; `spacing` is the span's length in space.
float knot_distance(const std::vector<float>& knots, float parameter, float metres_per_parameter, float& spacing) {
  const auto upper = std::upper_bound(knots.begin() + 1, knots.end() - 1, parameter);
  spacing = (*upper - *(upper - 1)) * metres_per_parameter;
  float distance = infinity;
  if (upper != knots.end() - 1) distance = std::abs(*upper - parameter);
  if (upper - 1 != knots.begin()) distance = std::min(distance, std::abs(parameter - *(upper - 1)));
  return distance * metres_per_parameter;
}

struct Shader {
  const Cloth& cloth;
  const std::vector<std::array<Light, 2>>& light;
  const Camera& camera;
  ColourScale scale;
  Vector3f key, up;

  Vector3f operator()(const Hit& hit, const Vector3f& direction) const {
    const Face& triangle = cloth.triangles[hit.triangle];
    const std::array<float, 3> weight{1 - hit.b - hit.c, hit.b, hit.c};
    std::array<std::size_t, 3> at;
    for (std::size_t k = 0; k < 3; ++k) at[k] = static_cast<std::size_t>(triangle.vertex[k]);
    const Vector3f face = (cloth.x[at[1]] - cloth.x[at[0]]).cross(cloth.x[at[2]] - cloth.x[at[0]]);
    const bool back = face.dot(direction) > 0;
    Vector3f normal = Vector3f::Zero();
    Vector2f uv = Vector2f::Zero();
    Light seen{0, 0};
    float value = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      normal += weight[k] * cloth.normal[at[k]];
      uv += weight[k] * cloth.uv[at[k]];
      seen.sky += weight[k] * light[at[k]][back].sky;
      seen.key += weight[k] * light[at[k]][back].key;
      if (cloth.valued && triangle.panel >= 0) value += weight[k] * cloth.value[at[k]];
    }
    normal = (back ? -normal : normal).stableNormalized();
    const float facing = std::max(0.0f, -normal.dot(direction));
    const float hemisphere = 0.5f + 0.5f * normal.dot(up);
    const float shade =
        seen.sky * (0.36f + 0.16f * hemisphere) + 0.50f * seen.key * std::max(0.0f, normal.dot(key)) + 0.12f * facing;
    const Vector3f grey(0.62f, 0.64f, 0.68f), skin(0.80f, 0.76f, 0.72f);
    Vector3f colour = triangle.panel < 0 ? skin : cloth.valued ? scale.colour(value) : grey;
    colour = (back ? 0.92f : 1.0f) * shade * colour;
    colour +=
        Vector3f::Constant(0.05f * std::pow(1 - facing, 3.0f) * seen.sky);  // the sheen of cloth seen at a low angle

    if (triangle.panel < 0) return colour;

    // Lines have constant width on the screen where the cloth faces it.
    const float pixel = camera.pixel * hit.distance * -direction.dot(camera.back);
    float knot_line = 0;
    for (std::size_t d = 0; d < 2; ++d) {
      float spacing = 0;
      const auto& knots = cloth.knots[static_cast<std::size_t>(triangle.panel)][d];
      const float distance = knot_distance(knots, uv[static_cast<Eigen::Index>(d)],
                                           triangle.metres_per_parameter[static_cast<Eigen::Index>(d)], spacing);
      if (distance < 0.5f * pixel) knot_line = std::max(knot_line, std::clamp(spacing / pixel / 8 - 0.5f, 0.0f, 1.0f));
    }
    colour *= 1 - 0.30f * knot_line;
    for (std::size_t k = 0; k < 3; ++k) {
      if (!triangle.border[k]) continue;
      const float height = face.norm() / (cloth.x[at[(k + 2) % 3]] - cloth.x[at[(k + 1) % 3]]).norm();
      if (weight[k] * height < 1.1f * pixel) return 0.35f * colour + 0.25f * ink;
    }
    return colour;
  }
};

}  // namespace

bool preview_available() {
  return true;
}

std::string preview_png(const Frame& frame, const PreviewOptions& options) {
  const Cloth cloth = gather(frame);
  const Rays rays(cloth);
  const Vector3f up = options.up.norm() > 0 ? Vector3f(options.up.normalized().cast<float>()) : Vector3f(0, 0, 1);
  const float unit = static_cast<float>(std::min(options.width, options.height)) / 700;
  const auto width = static_cast<float>(options.width), height = static_cast<float>(options.height);
  const Vector3f back = view_direction(cloth, options, up);
  const Camera camera = fit_camera(cloth, back, up, {48 * unit, width - 150 * unit, 44 * unit, height - 62 * unit});
  // The lamp stands behind the viewer's left shoulder.
  const Vector3f key = (back + 0.75f * camera.up - 0.55f * camera.right).normalized();

  // Light changes slowly over the cloth: found at the vertices, on both sides, it is free of noise.
  constexpr std::size_t ray_budget = 2'400'000;
  const auto rays_each = static_cast<unsigned>(std::clamp<std::size_t>(ray_budget / (2 * cloth.x.size()), 16, 160));
  const Lighting lighting(cloth, rays, key, 3 * rays_each / 4, rays_each / 4);
  std::vector<std::array<Light, 2>> light(cloth.x.size());
  for_all(static_cast<int>(cloth.x.size()), [&](int k) {
    const auto at = static_cast<std::size_t>(k);
    light[at] = {lighting.at(cloth.x[at], cloth.normal[at]), lighting.at(cloth.x[at], -cloth.normal[at])};
  });
  const Lighting ground_lighting(cloth, rays, key, 48, 24);
  const Ground ground(cloth, ground_lighting, up);

  ColourScale scale;
  if (cloth.valued) {
    std::vector<std::vector<float>> rows(static_cast<std::size_t>(options.height));
    for_all(options.height, [&](int y) {
      for (int x = 0; x < options.width; ++x) {
        const Hit hit =
            rays.nearest(camera.place, camera.direction(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f));
        if (!hit || cloth.triangles[hit.triangle].panel < 0) continue;
        const auto& v = cloth.triangles[hit.triangle].vertex;
        const auto value = [&](int k) { return cloth.value[static_cast<std::size_t>(v[static_cast<std::size_t>(k)])]; };
        rows[static_cast<std::size_t>(y)].push_back((1 - hit.b - hit.c) * value(0) + hit.b * value(1) +
                                                    hit.c * value(2));
      }
    });
    std::vector<float> values;
    for (const auto& row : rows) values.insert(values.end(), row.begin(), row.end());
    scale = scale_of(values.empty() ? cloth.value : std::move(values), options.range);
    // What the bar says of extremes is true of all the cloth, seen or not.
    const auto [least, most] = std::ranges::minmax_element(cloth.value);
    scale.least = *least, scale.most = *most;
  }

  const Shader shader{cloth, light, camera, scale, key, up};
  Image image(options.width, options.height);
  for_all(options.height, [&](int y) {
    constexpr int grid = 3;  // rays per pixel and direction
    const float fall = static_cast<float>(y) / height;
    const Vector3f paper = Vector3f(0.955f, 0.965f, 0.98f) - fall * Vector3f(0.115f, 0.105f, 0.095f);
    for (int x = 0; x < options.width; ++x) {
      Vector3f sum = Vector3f::Zero();
      for (int k = 0; k < grid * grid; ++k) {
        const float dx = (static_cast<float>(k % grid) + 0.5f) / grid,
                    dy = (static_cast<float>(k / grid) + 0.5f) / grid;
        const Vector3f direction = camera.direction(static_cast<float>(x) + dx, static_cast<float>(y) + dy);
        const Hit hit = rays.nearest(camera.place, direction);
        const Vector3f colour =
            hit ? shader(hit, direction) : Vector3f(ground.brightness(camera.place, direction) * paper);
        sum += colour.cwiseMin(1.0f);
      }
      image.at(x, y) = sum / (grid * grid);
    }
  });

  if (cloth.valued) draw_strain_bar(image, scale, unit);
  if (!options.title.empty()) draw_text(image, 24 * unit, height - 22 * unit, 10 * unit, options.title, 3 * ink);
  return png(image);
}

}  // namespace toile
