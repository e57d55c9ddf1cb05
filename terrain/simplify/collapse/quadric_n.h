#pragma once
// Generalised error quadrics: the squared distance to the planes of triangles in R^N.
//
// [Han04] and [Min], "EQEM", after [Garland98]. A vertex is a point of R^N: position, then
// attributes. Triangle (p, q, r) spans a plane with orthonormal e1, e2 (Gram-Schmidt). The squared
// distance of v to it is v^T A v + 2 b.v + c with
//     A = I - e1 e1^T - e2 e2^T,   b = (p.e1) e1 + (p.e2) e2 - p,   c = p.p - (p.e1)^2 - (p.e2)^2
// Every quadric is relative to a point of its own (its vertex). There, b and c of a new quadric are
// zero, and float is precise enough. A quadric has (N + 1)(N + 2) / 2 coefficients: 10, 21, 28 and
// 55 for N = 3 (geometry), 5 (+ texture), 6 (+ colour) and 9 (+ colour + normal).

#include <array>
#include <cmath>

namespace tind {

template <int N>
using PointN = std::array<double, N>;

template <int N>
struct QuadricN {
  static constexpr int kMatrix = N * (N + 1) / 2;
  static constexpr int kCoefficients = kMatrix + N + 1;

  std::array<float, kMatrix> a{};  // upper triangle by rows
  std::array<float, N> b{};
  float c = 0;

  static constexpr int at(int i, int j) { return i * N - i * (i - 1) / 2 + (j - i); }  // i <= j

  /// `weight` times the squared distance to the plane of pqr, relative to any of the three, plus
  /// `spring` times the squared distance to that point. A degenerate triangle adds its spring only.
  static QuadricN of_triangle(const PointN<N>& p, const PointN<N>& q, const PointN<N>& r,
                              double weight, double spring) {
    QuadricN out;
    PointN<N> e1, e2;
    double l1 = 0, l2 = 0, along = 0;
    for (int i = 0; i < N; ++i) l1 += (e1[i] = q[i] - p[i]) * e1[i];
    const double s1 = l1 > 0 ? 1 / std::sqrt(l1) : 0;
    for (int i = 0; i < N; ++i) along += (e1[i] *= s1) * (r[i] - p[i]);
    for (int i = 0; i < N; ++i) l2 += (e2[i] = r[i] - p[i] - along * e1[i]) * e2[i];
    const double s2 = l2 > 1e-20 * l1 ? 1 / std::sqrt(l2) : 0;
    if (s1 == 0 || s2 == 0) weight = 0;
    for (int i = 0; i < N; ++i) e2[i] *= s2;
    for (int i = 0; i < N; ++i) {
      for (int j = i; j < N; ++j)
        out.a[at(i, j)] = float(weight * ((i == j) - e1[i] * e1[j] - e2[i] * e2[j]));
      out.a[at(i, i)] += float(spring);
    }
    return out;
  }

  /// In three dimensions the plane has a normal; the same function, cheaper.
  /// `normal` need not be unit; `weight` is of the squared distance times its squared length.
  static QuadricN of_plane(const std::array<double, 3>& normal, double weight,
                           double spring) requires(N == 3) {
    QuadricN out;
    for (int i = 0; i < 3; ++i) {
      for (int j = i; j < 3; ++j) out.a[at(i, j)] = float(weight * normal[i] * normal[j]);
      out.a[at(i, i)] += float(spring);
    }
    return out;
  }

  /// The coefficient of d[i] d[j]. REQUIRES: i <= j.
  float operator()(int i, int j) const { return a[at(i, j)]; }

  void add(const QuadricN& q) {
    for (int i = 0; i < kMatrix; ++i) a[i] += q.a[i];
    for (int i = 0; i < N; ++i) b[i] += q.b[i];
    c += q.c;
  }

  /// A d.
  std::array<float, N> times(const std::array<float, N>& d) const {
    std::array<float, N> out{};
    for (int i = 0, k = 0; i < N; ++i) {
      out[i] += a[k++] * d[i];
      for (int j = i + 1; j < N; ++j, ++k) {
        out[i] += a[k] * d[j];
        out[j] += a[k] * d[i];
      }
    }
    return out;
  }

  float value(const std::array<float, N>& d) const {
    const std::array<float, N> ad = times(d);
    float sum = c;
    for (int i = 0; i < N; ++i) sum += d[i] * (ad[i] + 2 * b[i]);
    return sum;
  }

  /// The function and half its slope along coordinate `axis`.
  std::array<float, 2> value_and_slope(const std::array<float, N>& d, int axis) const {
    const std::array<float, N> ad = times(d);
    float sum = c;
    for (int i = 0; i < N; ++i) sum += d[i] * (ad[i] + 2 * b[i]);
    return {sum, ad[axis] + b[axis]};
  }

  /// The same function, relative to a point moved by `d`.
  void move_origin(const std::array<float, N>& d) {
    const std::array<float, N> ad = times(d);
    for (int i = 0; i < N; ++i) {
      c += d[i] * (ad[i] + 2 * b[i]);
      b[i] += ad[i];
    }
  }

  /// Where the function is least, by cofactors: in three dimensions cheaper than LDL^T.
  /// REQUIRES: positive definite; springs see to it.
  std::array<float, 3> least() const requires(N == 3) {
    const auto [xx, xy, xz, yy, yz, zz] = a;
    const float cxx = yy * zz - yz * yz, cxy = xz * yz - xy * zz, cxz = xy * yz - xz * yy;
    const float cyy = xx * zz - xz * xz, cyz = xy * xz - xx * yz, czz = xx * yy - xy * xy;
    const float s = -1 / (xx * cxx + xy * cxy + xz * cxz);
    return {s * (cxx * b[0] + cxy * b[1] + cxz * b[2]), s * (cxy * b[0] + cyy * b[1] + cyz * b[2]),
            s * (cxz * b[0] + cyz * b[1] + czz * b[2])};
  }

  /// The third coordinate at which the function is least for given others.
  float least_third(float x, float y) const requires(N == 3) {
    return -(b[2] + a[2] * x + a[4] * y) / a[5];
  }

  /// Where the function is least when the first `given` coordinates of `d` are as they stand; fills
  /// the others. LDL^T without pivoting: the springs keep the matrix positive definite; a pivot
  /// that rounding has eaten leaves its coordinate where it is.
  void least(std::array<float, N>& d, int given) const {
    std::array<float, kMatrix> l = a;
    std::array<float, N> x{};
    for (int i = given; i < N; ++i) {
      x[i] = -b[i];
      for (int j = 0; j < given; ++j) x[i] -= a[at(j, i)] * d[j];
    }
    for (int i = given; i < N; ++i) {
      const float pivot = l[at(i, i)];
      const float inverse = pivot > 1e-7f * a[at(i, i)] ? 1 / pivot : 0;
      l[at(i, i)] = inverse;
      for (int j = i + 1; j < N; ++j) {
        const float f = l[at(i, j)] * inverse;
        for (int k = j; k < N; ++k) l[at(j, k)] -= f * l[at(i, k)];
        x[j] -= f * x[i];
      }
    }
    for (int i = N - 1; i >= given; --i) {
      float sum = x[i];
      for (int j = i + 1; j < N; ++j) sum -= l[at(i, j)] * d[j];
      d[i] = sum * l[at(i, i)];
    }
  }
};

}  // namespace tind
