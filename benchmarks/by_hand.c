// Kernels as an expert would write them: motors are dual quaternions (w, b) + e (s, d), everything else consists of
// three-vectors. Arrays are in Fortran order (structure of arrays): coefficient k of element i is x[k * n + i].
//
// The functions have the signature of the loops in a generated file: args are the inputs and then the output, and
// dimensions[0] is the number of elements. The strides are ignored. REAL is double or float.

#include <stdint.h>

#define LOOP char **args, const intptr_t *dimensions, const intptr_t *steps
#define START                       \
    const intptr_t n = *dimensions; \
    (void)steps;
#define IN(name, k) const REAL *restrict name = (const REAL *)args[k];
#define OUT(k) REAL *restrict out = (REAL *)args[k];
#define EACH _Pragma("GCC ivdep") for (intptr_t i = 0; i < n; i++)
#define AT(x, k) x[(k) * n + i]
#define INLINE static inline __attribute__((always_inline))

typedef struct {
    REAL x, y, z;
} vector;

INLINE REAL dot(vector a, vector b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

INLINE vector cross(vector a, vector b)
{
    return (vector){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

INLINE vector add(vector a, vector b)
{
    return (vector){a.x + b.x, a.y + b.y, a.z + b.z};
}

INLINE vector subtract(vector a, vector b)
{
    return (vector){a.x - b.x, a.y - b.y, a.z - b.z};
}

INLINE vector scale(REAL k, vector a)
{
    return (vector){k * a.x, k * a.y, k * a.z};
}

// The vectors among the coefficients of the generated modules.
#define XYZ(x, k) ((vector){AT(x, k), AT(x, k + 1), AT(x, k + 2)})
#define TURN(m) ((vector){-AT(m, 3), AT(m, 2), -AT(m, 1)})
#define SHIFT(m) ((vector){-AT(m, 4), -AT(m, 5), -AT(m, 6)})
#define SPIN(m) (-AT(m, 7))

void repeat(void (*loop)(LOOP), LOOP, intptr_t times)
{
    while (times-- > 0)
        loop(args, dimensions, steps);
}

void pga3_motor_product(LOOP)
{
    START IN(l, 0) IN(r, 1) OUT(2)
    EACH
    {
        const REAL w = AT(l, 0), s = SPIN(l), v = AT(r, 0), t = SPIN(r);
        const vector b = TURN(l), d = SHIFT(l), c = TURN(r), e = SHIFT(r);
        const vector turn = add(add(scale(w, c), scale(v, b)), cross(b, c));
        const vector shift = add(add(add(scale(w, e), scale(s, c)), add(scale(v, d), scale(t, b))),
                                 add(cross(b, e), cross(d, c)));
        AT(out, 0) = w * v - dot(b, c);
        AT(out, 1) = -turn.z;
        AT(out, 2) = turn.y;
        AT(out, 3) = -turn.x;
        AT(out, 4) = -shift.x;
        AT(out, 5) = -shift.y;
        AT(out, 6) = -shift.z;
        AT(out, 7) = dot(b, e) + dot(d, c) - (w * t + s * v);
    }
}

// p + 2 (w t + b x t - s b), t = b x p + d
void pga3_move_point(LOOP)
{
    START IN(m, 0) IN(x, 1) OUT(2)
    EACH
    {
        const REAL w = AT(m, 0), s = SPIN(m);
        const vector b = TURN(m), d = SHIFT(m), p = XYZ(x, 0);
        const vector t = add(cross(b, p), d);
        const vector u = subtract(add(scale(w, t), cross(b, t)), scale(s, b));
        AT(out, 0) = p.x + 2 * u.x;
        AT(out, 1) = p.y + 2 * u.y;
        AT(out, 2) = p.z + 2 * u.z;
    }
}

// A line is a dual vector l + e m of direction and moment. It transforms like a vector, over the dual numbers.
void pga3_move_line(LOOP)
{
    START IN(motor, 0) IN(x, 1) OUT(2)
    EACH
    {
        const REAL w = AT(motor, 0), s = SPIN(motor);
        const vector b = TURN(motor), d = SHIFT(motor);
        const vector l = {AT(x, 2), -AT(x, 1), AT(x, 0)}, m = XYZ(x, 3);
        const vector t = cross(b, l), dual = add(cross(b, m), cross(d, l));
        const vector u = add(scale(w, t), cross(b, t));
        const vector v = add(add(scale(w, dual), scale(s, t)), add(cross(b, dual), cross(d, t)));
        AT(out, 0) = l.z + 2 * u.z;
        AT(out, 1) = -(l.y + 2 * u.y);
        AT(out, 2) = l.x + 2 * u.x;
        AT(out, 3) = m.x + 2 * v.x;
        AT(out, 4) = m.y + 2 * v.y;
        AT(out, 5) = m.z + 2 * v.z;
    }
}

// n + 2 b x v, v = w n + b x n; the offset decreases by 2 (v . d - s (n . b))
void pga3_move_plane(LOOP)
{
    START IN(m, 0) IN(x, 1) OUT(2)
    EACH
    {
        const REAL w = AT(m, 0), s = SPIN(m);
        const vector b = TURN(m), d = SHIFT(m), normal = XYZ(x, 0);
        const vector v = add(scale(w, normal), cross(b, normal)), u = cross(b, v);
        AT(out, 0) = normal.x + 2 * u.x;
        AT(out, 1) = normal.y + 2 * u.y;
        AT(out, 2) = normal.z + 2 * u.z;
        AT(out, 3) = AT(x, 3) - 2 * (dot(v, d) - s * dot(normal, b));
    }
}

void pga3_join_points(LOOP)
{
    START IN(x, 0) IN(y, 1) OUT(2)
    EACH
    {
        const vector a = XYZ(x, 0), b = XYZ(y, 0), moment = cross(a, b);
        AT(out, 0) = b.z - a.z;
        AT(out, 1) = a.y - b.y;
        AT(out, 2) = b.x - a.x;
        AT(out, 3) = moment.x;
        AT(out, 4) = moment.y;
        AT(out, 5) = moment.z;
    }
}

// Cramer's rule, with two of its three cross products combined.
void pga3_meet_three_planes(LOOP)
{
    START IN(x, 0) IN(y, 1) IN(z, 2) OUT(3)
    EACH
    {
        const vector p = XYZ(x, 0), q = XYZ(y, 0), r = XYZ(z, 0), c = cross(q, r);
        const vector rest = cross(p, subtract(scale(AT(y, 3), r), scale(AT(z, 3), q)));
        const vector point = subtract(rest, scale(AT(x, 3), c));
        AT(out, 0) = dot(p, c);
        AT(out, 1) = point.x;
        AT(out, 2) = point.y;
        AT(out, 3) = point.z;
    }
}

// v + 2 (w t + b x t), t = b x v
void vga3_rotate_vector(LOOP)
{
    START IN(m, 0) IN(x, 1) OUT(2)
    EACH
    {
        const vector b = TURN(m), v = XYZ(x, 0), t = cross(b, v), u = add(scale(AT(m, 0), t), cross(b, t));
        AT(out, 0) = v.x + 2 * u.x;
        AT(out, 1) = v.y + 2 * u.y;
        AT(out, 2) = v.z + 2 * u.z;
    }
}

void quaternion_product(LOOP)
{
    START IN(l, 0) IN(r, 1) OUT(2)
    EACH
    {
        const REAL w = AT(l, 0), v = AT(r, 0);
        const vector a = XYZ(l, 1), b = XYZ(r, 1), c = add(add(scale(w, b), scale(v, a)), cross(a, b));
        AT(out, 0) = w * v - dot(a, b);
        AT(out, 1) = c.x;
        AT(out, 2) = c.y;
        AT(out, 3) = c.z;
    }
}
