// The part of the runtime that is compiled once for all generated C modules: it copies batches with arbitrary strides
// to the loops of a kernel and back. In a block, each component of a part (an argument or a result) is a row of `row`
// numbers, one for each element.
//
// To link a program with less, compile this file several times, for a static library: with GAC_PART_COPIES, with
// GAC_PART_BATCHES (kernels without loops) and with GAC_PART_ROWS (kernels with loops), and each of them with ONLY_F64
// and with ONLY_F32. With GAC_OWN_SIZES, a file gac_sizes.h defines FEW_SPANS and MANY_SPANS, see below. The package
// that `gac generate --cmake` writes does this.

#ifndef REAL
#include "gac_runtime.h"

#include <stdlib.h>

#if defined(GAC_PART_COPIES) || defined(GAC_PART_BATCHES) || defined(GAC_PART_ROWS)
#define GAC_IN_PARTS
#define GAC_PIECE GAC_SHARED
#else
#define GAC_PART_COPIES
#define GAC_PART_BATCHES
#define GAC_PART_ROWS
#define GAC_PIECE static
#endif

// Functions that are compiled for each level of machines and selected when the library is loaded, or for one level.
#if defined(ON_v4) && defined(GAC_LEVEL)
#if GAC_LEVEL >= 4
#define WIDE ON_v4
#else
#define WIDE
#endif
#elif defined(NAMES_MACHINES) && defined(__GLIBC__)
#define WIDE __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define WIDE
#endif

// Whether this machine supports the instructions of the library. It is called before all other functions, and therefore
// must itself run on every machine.
#if defined(ON_v4) && defined(GAC_LEVEL) && !defined(ONLY_F32) && defined(GAC_PART_COPIES)
#if GAC_LEVEL >= 4
#define RUNS_HERE HAS_v4
#elif GAC_LEVEL == 3
#define RUNS_HERE HAS_v3
#else
#define RUNS_HERE 1
#endif
int gac_runs_here(void);
__attribute__((target("no-avx,no-bmi,no-bmi2"))) int gac_runs_here(void)
{
    return RUNS_HERE ? 1 : 0;
}
#endif

// Number of elements up to which they are run one after the other.
#define ALONE 2

// Numbers in the rows of a block, which should fit into the first-level cache; more if the smallest block needs more.
#define SPACE 4096

// Limits of arrays of constant size. Kernels with more parts, axes or numbers use arrays whose size depends on them.
enum { USUAL_PARTS = 8, USUAL_CORES = 12, USUAL_NUMBERS = SPACE / LANES, USUAL_PREPARED = 48 };

// Bytes of a cache line.
enum { LINE = 64 };

#ifdef GAC_PART_BATCHES
// Results that exceed all caches are written by non-temporal stores of whole lines, which are not read first. The same
// holds for results that fit only into the last cache, if they have more rows than a core can have lines in flight.
#ifdef NAMES_MACHINES
#define PASSES(bytes, rows) ((bytes) > ((rows) > 16 ? 1 << 21 : 1 << 25))
ON_v3 static void gac_stream(char *to, const char *from, intptr_t bytes)
{
    typedef double half __attribute__((vector_size(LINE / 2), aligned(4), may_alias));
    const intptr_t start = -(intptr_t)to & (LINE - 1);
    intptr_t i = 0;
    for (; i < start && i < bytes; i += 4)
        memcpy(to + i, from + i, 4);
    for (; i + LINE <= bytes; i += LINE) {
        __builtin_ia32_movntpd256((double *)(to + i), *(const half *)(from + i));
        __builtin_ia32_movntpd256((double *)(to + i + LINE / 2), *(const half *)(from + i + LINE / 2));
    }
    for (; i < bytes; i += 4)
        memcpy(to + i, from + i, 4);
}
#define STREAM_END() __builtin_ia32_sfence()
#else
#define PASSES(bytes, rows) ((void)(rows), 0)
#define gac_stream memcpy
#define STREAM_END() (void)0
#endif

// Prefetch memory that is read or written soon.
static void gac_fetch(const char *from, intptr_t bytes, int to_write)
{
#ifdef __GNUC__
    for (intptr_t i = 0; i < bytes; i += LINE) {
        if (to_write)
            __builtin_prefetch(from + i, 1, 3);
        else
            __builtin_prefetch(from + i, 0, 2);
    }
#else
    (void)from, (void)bytes, (void)to_write;
#endif
}

// The offset of a component of an element; components are numbered in C order.
static intptr_t gac_offset_of(const struct gac_part *part, intptr_t k, const intptr_t *strides)
{
    intptr_t offset = 0;
    for (int axis = part->rank; axis-- > 1; k /= part->shape[axis])
        offset += k % part->shape[axis] * strides[axis];
    return part->rank ? offset + k * strides[0] : 0;
}

static int gac_is_flagged(unsigned flags, int p)
{
    return p < GAC_FLAGS && flags >> p & 1;
}

// The sizes of elements for which there are specialized functions between C order and rows: those that compilers
// transpose efficiently, and others. They are half of the code; elements of other sizes are copied number by number.
#ifdef GAC_OWN_SIZES
#include "gac_sizes.h"
#endif
#ifndef FEW_SPANS
#define FEW_SPANS(M) M(1) M(2) M(3)
#define MANY_SPANS(M)                                                                                 \
    M(4) M(5) M(6) M(7) M(8) M(9) M(10) M(11) M(12) M(13) M(14) M(15) M(16) M(17) M(18) M(19) M(20)   \
    M(21) M(22) M(23) M(24) M(25) M(26) M(27) M(28) M(29) M(30) M(31) M(32)
#endif

// How a part is passed to the loops: constant for all elements, prepared, at unit stride, or with other strides.
enum kind { SAME, HOISTED, UNIT, ANY };
#endif

#define AT(a, k, s) (*(GAC(four) *)((a) + (k) * (s)))

// Both precisions.
#define NAME(name) GAC(name)
#ifndef ONLY_F32
#define REAL double
#define PRECISION(of_double, of_float) of_double
#include "gac_runtime.c"
#undef REAL
#undef PRECISION
#endif
#ifndef ONLY_F64
#define REAL float
#define PRECISION(of_double, of_float) of_float
#include "gac_runtime.c"
#endif

#else

// For each precision.

#ifdef GAC_PART_COPIES
#ifdef SHUFFLE
#if PRECISION(1, 0)
// Copy from four addresses, `s` bytes apart, to four addresses, `t` bytes apart.
static INLINE void GAC(turn)(char *a, intptr_t s, char *b, intptr_t t)
{
    const GAC(four) a0 = AT(a, 0, s), a1 = AT(a, 1, s), a2 = AT(a, 2, s), a3 = AT(a, 3, s);
    const GAC(four) b0 = SHUFFLE(a0, a1, 0, 4, 2, 6), b1 = SHUFFLE(a0, a1, 1, 5, 3, 7);
    const GAC(four) b2 = SHUFFLE(a2, a3, 0, 4, 2, 6), b3 = SHUFFLE(a2, a3, 1, 5, 3, 7);
    AT(b, 0, t) = SHUFFLE(b0, b2, 0, 1, 4, 5);
    AT(b, 1, t) = SHUFFLE(b1, b3, 0, 1, 4, 5);
    AT(b, 2, t) = SHUFFLE(b0, b2, 2, 3, 6, 7);
    AT(b, 3, t) = SHUFFLE(b1, b3, 2, 3, 6, 7);
}

static INLINE void GAC(load_tile)(char *x, intptr_t row, char *a, intptr_t s)
{
    GAC(turn)(a, s, x, row);
}

static INLINE void GAC(store_tile)(char *a, intptr_t s, char *x, intptr_t row)
{
    GAC(turn)(x, row, a, s);
}
#else
typedef REAL GAC(eight) VECTOR(8);
#define ROW(x, k, row) (*(GAC(eight) *)((x) + (k) * (row)))

static INLINE void GAC(load_tile)(char *x, intptr_t row, char *a, intptr_t s)
{
#define PAIR(k) SHUFFLE(AT(a, k, s), AT(a, (k) + 4, s), 0, 1, 2, 3, 4, 5, 6, 7)
    const GAC(eight) a0 = PAIR(0), a1 = PAIR(1), a2 = PAIR(2), a3 = PAIR(3);
#undef PAIR
    const GAC(eight) b0 = SHUFFLE(a0, a1, 0, 8, 1, 9, 4, 12, 5, 13), b1 = SHUFFLE(a0, a1, 2, 10, 3, 11, 6, 14, 7, 15);
    const GAC(eight) b2 = SHUFFLE(a2, a3, 0, 8, 1, 9, 4, 12, 5, 13), b3 = SHUFFLE(a2, a3, 2, 10, 3, 11, 6, 14, 7, 15);
    ROW(x, 0, row) = SHUFFLE(b0, b2, 0, 1, 8, 9, 4, 5, 12, 13);
    ROW(x, 1, row) = SHUFFLE(b0, b2, 2, 3, 10, 11, 6, 7, 14, 15);
    ROW(x, 2, row) = SHUFFLE(b1, b3, 0, 1, 8, 9, 4, 5, 12, 13);
    ROW(x, 3, row) = SHUFFLE(b1, b3, 2, 3, 10, 11, 6, 7, 14, 15);
}

static INLINE void GAC(store_tile)(char *a, intptr_t s, char *x, intptr_t row)
{
    const GAC(eight) x0 = ROW(x, 0, row), x1 = ROW(x, 1, row), x2 = ROW(x, 2, row), x3 = ROW(x, 3, row);
    const GAC(eight) b0 = SHUFFLE(x0, x1, 0, 8, 1, 9, 4, 12, 5, 13), b1 = SHUFFLE(x0, x1, 2, 10, 3, 11, 6, 14, 7, 15);
    const GAC(eight) b2 = SHUFFLE(x2, x3, 0, 8, 1, 9, 4, 12, 5, 13), b3 = SHUFFLE(x2, x3, 2, 10, 3, 11, 6, 14, 7, 15);
    const GAC(eight) a0 = SHUFFLE(b0, b2, 0, 1, 8, 9, 4, 5, 12, 13), a1 = SHUFFLE(b0, b2, 2, 3, 10, 11, 6, 7, 14, 15);
    const GAC(eight) a2 = SHUFFLE(b1, b3, 0, 1, 8, 9, 4, 5, 12, 13), a3 = SHUFFLE(b1, b3, 2, 3, 10, 11, 6, 7, 14, 15);
#define HALVES(k, v) AT(a, k, s) = SHUFFLE(v, v, 0, 1, 2, 3), AT(a, (k) + 4, s) = SHUFFLE(v, v, 4, 5, 6, 7)
    HALVES(0, a0);
    HALVES(1, a1);
    HALVES(2, a2);
    HALVES(3, a3);
#undef HALVES
}
#undef ROW
#endif

// Load tiles of `size` contiguous components of elements `s` bytes apart, and return the number of elements done. This
// takes half the time if the size is known at compile time.
static INLINE intptr_t GAC(turn_tiles)(int back, char *x, intptr_t row, char *a, intptr_t s, intptr_t size, intptr_t n)
{
    const intptr_t w = sizeof(REAL);
    intptr_t done = 0;
    NOT_UNROLLED
    for (; done + TILE <= n; done += TILE) {
        for (intptr_t k = 0; k < size; k += 4) {
            const intptr_t first = k + 4 <= size ? k : size - 4;
            char *in_rows = x + first * row + done * w, *in_element = a + done * s + first * w;
            if (back)
                GAC(store_tile)(in_element, s, in_rows, row);
            else
                GAC(load_tile)(in_rows, row, in_element, s);
        }
    }
    return done;
}

static INLINE intptr_t GAC(turn_all)(int back, REAL *x, intptr_t row, char *a, intptr_t s, intptr_t size, intptr_t n)
{
    switch (size) {
    case 4:
        return GAC(turn_tiles)(back, (char *)x, row * sizeof(REAL), a, s, 4, n);
    case 6:
        return GAC(turn_tiles)(back, (char *)x, row * sizeof(REAL), a, s, 6, n);
    case 8:
        return GAC(turn_tiles)(back, (char *)x, row * sizeof(REAL), a, s, 8, n);
    default:
        return GAC(turn_tiles)(back, (char *)x, row * sizeof(REAL), a, s, size, n);
    }
}
#endif

// Load rows of `size` components, `c` bytes apart, of `n` elements, `s` bytes apart.
WIDE GAC_PIECE void GAC(load_rows)(REAL *x, intptr_t row, char *a, intptr_t s, intptr_t c, intptr_t size, intptr_t n)
{
    const intptr_t w = sizeof(REAL);
    intptr_t done = 0;
    if (size == 3 && c == w && s == 3 * w) {
        const REAL *b = (const REAL *)a;
        ANY_ORDER
        for (intptr_t i = 0; i < n; ++i) {
            x[i] = b[3 * i];
            x[i + row] = b[3 * i + 1];
            x[i + 2 * row] = b[3 * i + 2];
        }
        return;
    }
#ifdef SHUFFLE
    if (size >= 4 && c == w) {
        done = GAC(turn_all)(0, x, row, a, s, size, n);
    } else if (s != w) {
        for (; done + 4 <= n; done += 4) {
            for (intptr_t k = 0; k < size; ++k) {
                const char *b = a + done * s + k * c;
                *(GAC(four) *)(x + k * row + done) = (GAC(four)){*(const REAL *)b, *(const REAL *)(b + s),
                    *(const REAL *)(b + 2 * s), *(const REAL *)(b + 3 * s)};
            }
        }
    }
#endif
    if (done == n)
        return;
    for (intptr_t k = 0; k < size; ++k) {
        const char *from = a + k * c;
        REAL *to = x + k * row;
        if (s == w) {
            ANY_ORDER
            for (intptr_t i = done; i < n; ++i)
                to[i] = ((const REAL *)from)[i];
        } else {
            for (intptr_t i = done; i < n; ++i)
                to[i] = *(const REAL *)(from + i * s);
        }
    }
}

// The inverse of load_rows.
WIDE GAC_PIECE void GAC(store_rows)(char *a, intptr_t s, intptr_t c, REAL *x, intptr_t row, intptr_t size, intptr_t n)
{
    const intptr_t w = sizeof(REAL);
    intptr_t done = 0;
    if (size == 3 && c == w && s == 3 * w) {
        REAL *b = (REAL *)a;
        ANY_ORDER
        for (intptr_t i = 0; i < n; ++i) {
            b[3 * i] = x[i];
            b[3 * i + 1] = x[i + row];
            b[3 * i + 2] = x[i + 2 * row];
        }
        return;
    }
#ifdef SHUFFLE
    if (size >= 4 && c == w)
        done = GAC(turn_all)(1, x, row, a, s, size, n);
#endif
    if (done == n)
        return;
    for (intptr_t k = 0; k < size; ++k) {
        const REAL *from = x + k * row;
        char *to = a + k * c;
        for (intptr_t i = done; i < n; ++i)
            *(REAL *)(to + i * s) = from[i];
    }
}

#else
GAC_SHARED void GAC(load_rows)(REAL *x, intptr_t row, char *a, intptr_t s, intptr_t c, intptr_t size, intptr_t n);
GAC_SHARED void GAC(store_rows)(char *a, intptr_t s, intptr_t c, REAL *x, intptr_t row, intptr_t size, intptr_t n);
#endif

#ifdef GAC_PART_BATCHES
// Copy `n` elements of at most three numbers in C order to rows, each `row` numbers long, and back.
static INLINE void GAC(load_few)(REAL *x, const REAL *a, intptr_t size, intptr_t row, intptr_t n)
{
    if (size == 1) {
        memcpy(x, a, n * sizeof(REAL));
    } else if (size == 2) {
        for (intptr_t i = 0; i < n; ++i) {
            x[i] = a[2 * i];
            x[row + i] = a[2 * i + 1];
        }
    } else {
        for (intptr_t i = 0; i < n; ++i) {
            x[i] = a[3 * i];
            x[row + i] = a[3 * i + 1];
            x[2 * row + i] = a[3 * i + 2];
        }
    }
}

// Loops between rows and elements, for each size.
#define FEW_SPAN(size)                                                                                \
    GAC_HEAD(load_span_##size)                                                                        \
    {                                                                                                 \
        (void)strides;                                                                                \
        GAC(load_few)((REAL *)args[0], (REAL *)args[1], size, SPAN, n);                               \
    }                                                                                                 \
    LOOPS(load_span_##size)                                                                           \
    GAC_HEAD(store_span_##size)                                                                       \
    {                                                                                                 \
        (void)strides;                                                                                \
        GAC(store_few)((REAL *)args[1], (REAL *)args[0], size, SPAN, n);                              \
    }                                                                                                 \
    LOOPS(store_span_##size)
#define SPAN_OF(size)                                                                                 \
    GAC_TILE(size)                                                                                    \
    GAC_HEAD_v3(load_span_##size)                                                                     \
    {                                                                                                 \
        (void)strides;                                                                                \
        NOT_UNROLLED                                                                                  \
        for (intptr_t i = 0; i < n; i += TILE)                                                        \
            GAC(load_tile_##size)((REAL *)args[0] + i, SPAN, (REAL *)args[1] + i * size);             \
    }                                                                                                 \
    LOOP(load_span_##size)                                                                            \
    GAC_HEAD_v3(store_span_##size)                                                                    \
    {                                                                                                 \
        (void)strides;                                                                                \
        NOT_UNROLLED                                                                                  \
        for (intptr_t i = 0; i < n; i += TILE)                                                        \
            GAC(store_tile_##size)((REAL *)args[1] + i * size, (REAL *)args[0] + i, SPAN);            \
    }                                                                                                 \
    LOOP(store_span_##size)
FEW_SPANS(FEW_SPAN)
MANY_SPANS(SPAN_OF)

#define FEW_ENTRY(size) [size] = {WIDTHS(load_span_##size), WIDTHS(store_span_##size)},
#define MANY_ENTRY(size) [size] = {WIDTH(load_span_##size), WIDTH(store_span_##size)},
static const struct {
    gac_loop *load[2], *store[2];
} GAC(spans)[GAC_TILE_NUMBERS + 1] = {[0] = {{NULL}, {NULL}}, FEW_SPANS(FEW_ENTRY) MANY_SPANS(MANY_ENTRY)};

// Copy all rows of a part from the batch or back to it; contiguous axes are merged.
static void GAC(move_part)(int back, REAL *x, intptr_t row, const struct gac_part *part, char *a, intptr_t s,
    const intptr_t *c, intptr_t n)
{
    intptr_t count = 1, step = sizeof(REAL);
    int axis = part->rank;
    for (; axis > 0 && (count == 1 || c[axis - 1] == count * step); --axis) {
        step = count == 1 ? c[axis - 1] : step;
        count *= part->shape[axis - 1];
    }
    if (count == part->size && back)
        GAC(store_rows)(a, s, step, x, row, count, n);
    else if (count == part->size)
        GAC(load_rows)(x, row, a, s, step, count, n);
    for (intptr_t k = 0; count < part->size && k < part->size; k += count) {
        intptr_t offset = 0, rest = k / count;
        for (int outer = axis; outer-- > 0; rest /= part->shape[outer])
            offset += rest % part->shape[outer] * c[outer];
        if (back)
            GAC(store_rows)(a + offset, s, step, x + k * row, row, count, n);
        else
            GAC(load_rows)(x + k * row, row, a + offset, s, step, count, n);
    }
}

// Copy the numbers of one element of a part from the batch or back to it.
static INLINE void GAC(move_element)(int back, REAL *x, const struct gac_part *part, char *a, const intptr_t *c)
{
    const intptr_t size = part->size, step = part->rank ? c[0] : 0;
    const int is_row = part->rank < 2;
    for (intptr_t k = 0; k < size; ++k) {
        REAL *number = (REAL *)(a + (is_row ? k * step : gac_offset_of(part, k, c)));
        if (back)
            *number = x[k];
        else
            x[k] = *number;
    }
}

// Write all rows of a part by non-temporal stores to a batch in which they are contiguous.
static void GAC(stream_part)(REAL *x, intptr_t row, const struct gac_part *part, char *a, const intptr_t *c, intptr_t n)
{
    for (intptr_t k = 0; k < part->size; ++k)
        gac_stream(a + gac_offset_of(part, k, c), (const char *)(x + k * row), n * sizeof(REAL));
}

// Run a kernel on one element after the other; the caller supplies memory for the numbers and addresses of one element.
static INLINE void GAC(each_in)(REAL *numbers, void **places, const struct gac_kernel *kernel, char **args, intptr_t n,
    const intptr_t *steps)
{
    const intptr_t *strides = steps + kernel->n_parts;
    const struct gac_part *parts = kernel->parts;
    REAL *next = numbers;
    for (int p = 0; p < kernel->n_parts; next += parts[p++].size)
        places[p] = next;
    for (intptr_t i = 0; i < n; ++i) {
        for (int p = 0; p < kernel->n_inputs; ++p)
            GAC(move_element)(0, places[p], &parts[p], args[p] + i * steps[p], strides + parts[p].first);
        kernel->call(kernel->function, places);
        for (int p = kernel->n_inputs; p < kernel->n_parts; ++p)
            GAC(move_element)(1, places[p], &parts[p], args[p] + i * steps[p], strides + parts[p].first);
    }
}

static void GAC(each)(const struct gac_kernel *kernel, char **args, intptr_t n, const intptr_t *steps)
{
    if (kernel->n_parts <= USUAL_PARTS && kernel->n_numbers <= USUAL_NUMBERS) {
        REAL numbers[USUAL_NUMBERS];
        void *places[USUAL_PARTS];
        GAC(each_in)(numbers, places, kernel, args, n, steps);
    } else {
        REAL numbers[kernel->n_numbers];
        void *places[kernel->n_parts];
        GAC(each_in)(numbers, places, kernel, args, n, steps);
    }
}

// Run a loop over `n` elements in place, from the `first` on; `starts` is memory for their addresses.
static void GAC(run_from)(intptr_t first, intptr_t n, const struct gac_kernel *kernel, gac_loop *loop, char **args,
    const intptr_t *steps, unsigned hoisted, REAL *prepared, char **starts)
{
    for (int p = 0; p < kernel->n_parts; ++p)
        starts[p] = gac_is_flagged(hoisted, p) ? (char *)prepared : args[p] + first * steps[p];
    loop(n, starts, steps + kernel->n_parts);
}

// Run a loop over elements in place, `unit` at a time, and return the number of elements done. Elements before `head`
// are run with some after them, and the last elements with some before them. These are run twice, which is possible
// only if results do not overwrite arguments.
static INLINE intptr_t GAC(as_they_lie)(intptr_t unit, intptr_t head, const struct gac_kernel *kernel, gac_loop *loop,
    char **args, intptr_t n, const intptr_t *steps, unsigned hoisted, REAL *prepared, char **starts)
{
    int twice = n > unit;
    for (int p = kernel->n_inputs; p < kernel->n_parts; ++p)
        for (int q = 0; q < kernel->n_inputs; ++q)
            twice = twice && args[p] != args[q];
    const intptr_t first = twice ? head : 0, whole = (n - first) & -unit;
    if (first)
        GAC(run_from)(0, unit, kernel, loop, args, steps, hoisted, prepared, starts);
    if (whole)
        GAC(run_from)(first, whole, kernel, loop, args, steps, hoisted, prepared, starts);
    if (!twice || first + whole == n)
        return first + whole;
    GAC(run_from)(n - unit, unit, kernel, loop, args, steps, hoisted, prepared, starts);
    return n;
}

// Run a kernel over a batch, with memory for the given numbers of entries in rows, prepared numbers, parts and axes;
// arrays of constant size are faster to allocate than others.
static INLINE void GAC(batch_in)(REAL *space, intptr_t n_space, REAL *prepared, enum kind *kinds, gac_loop **loads,
    gac_loop **stores, REAL **rows, char **starts, char **rest, intptr_t *cores, intptr_t *row_cores,
    const struct gac_kernel *kernel, char **args, intptr_t n, const intptr_t *steps, int width)
{
    const intptr_t w = sizeof(REAL), *strides = steps + kernel->n_parts;
    const int n_parts = kernel->n_parts, n_inputs = kernel->n_inputs, total = kernel->n_numbers;
    gac_loop *in_rows = kernel->block[width], *in_order = kernel->dense[width];
    intptr_t numbers = 0, results = 0, bytes = 0;
    unsigned still = 0, hoisted = 0;
    int in_place = 1, ordered = 1, known = 1, at_unit_stride = 1, together = kernel->together;
    for (int p = 0; p < n_parts; ++p) {
        const struct gac_part *part = &kernel->parts[p];
        const int same = p < n_inputs && p < GAC_FLAGS && steps[p] == 0;
        intptr_t step = w;
        for (int q = part->rank; q-- > 0; step *= part->shape[q])
            ordered = ordered && (same || strides[part->first + q] == step);
        ordered = ordered && (same || steps[p] == step);
        known = known && part->size <= GAC_TILE_NUMBERS && GAC(spans)[part->size].load[width];
        numbers += same ? 0 : part->size;
        results += p < n_inputs ? 0 : part->size;
        bytes += steps[p] < 0 ? -steps[p] : steps[p];
        if (same)
            still |= 1u << p;
    }
    for (int f = 0; f < kernel->n_forms && !hoisted; ++f) {
        const struct gac_form *form = &kernel->forms[f];
        if ((still & form->same) == form->same && n >= form->least) {
            form->start(args, strides, prepared);
            hoisted = form->same, together = form->together;
            in_rows = form->block[width], in_order = form->dense[width];
        }
    }
    // Non-temporal stores are used for results that exceed the caches, if the kernel is limited by memory bandwidth and
    // all rows have the same alignment to cache lines.
    int past = PASSES(n * numbers * w, results) && !kernel->busy && !ordered;
    for (int p = n_inputs; past && p < n_parts; ++p) {
        const struct gac_part *part = &kernel->parts[p];
        past = steps[p] == w && (args[p] - args[n_inputs]) % LINE == 0;
        for (int q = part->first; past && q < part->first + part->rank; ++q)
            past = strides[q] % LINE == 0;
    }
    // Number of elements before the first whose result starts a cache line. A vector stored across two lines takes
    // twice the time, so an additional iteration pays off for many elements that exceed the first-level cache.
    const int aligned = past || (steps[n_inputs] == w && n >= 16 * LANES && n * numbers * w >= 1 << 15);
    intptr_t head = aligned ? (-(intptr_t)args[n_inputs] & (LINE - 1)) / w : 0;
    // If all arrays can be used in place, the whole batch is run at once.
    for (int p = 0; p < n_parts; ++p)
        at_unit_stride = at_unit_stride && (steps[p] == w || gac_is_flagged(hoisted, p));
    gac_loop *const at_once = ordered && still == hoisted && in_order ? in_order
        : at_unit_stride && !past && !kernel->repeats ? in_rows : NULL;
    if (at_once) {
        const intptr_t unit = at_once == in_order ? together : LANES, first = at_once == in_order ? 0 : head;
        const intptr_t done = GAC(as_they_lie)(unit, first, kernel, at_once, args, n, steps, hoisted, prepared, rest);
        for (int p = 0; p < n_parts; ++p)
            rest[p] = args[p] + done * steps[p];
        args = rest, n -= done, head = 0;
        if (n == 0)
            return;
    }
    // Copying to rows costs more than computing a few elements one by one.
    if (n <= ALONE && !hoisted) {
        GAC(each)(kernel, args, n, steps);
        return;
    }
    const int spans = ordered && known && total * SPAN <= n_space;
    // Long rows need fewer calls; beyond the last-level cache, short rows let reads and writes overlap.
    const int near = n < (1 << 24) / (bytes + 1);
    intptr_t row = spans ? SPAN : near || past ? 512 / w : LANES;
    while (row > LANES && row * total > n_space)
        row /= 2;
    intptr_t before = 0;
    for (int p = 0; p < n_parts; ++p) {
        const struct gac_part *part = &kernel->parts[p];
        intptr_t row_step = row * w;
        starts[p] = gac_is_flagged(hoisted, p) ? (char *)prepared : args[p];
        rows[p] = space + row * before;
        before += part->size;
        kinds[p] = gac_is_flagged(hoisted, p) ? HOISTED : gac_is_flagged(still, p) ? SAME : steps[p] == w ? UNIT : ANY;
        for (int q = 0; kernel->repeats && p >= n_inputs && q < n_inputs; ++q)
            kinds[p] = args[p] == args[q] ? ANY : kinds[p];
        kinds[p] = past && p >= n_inputs ? ANY : kinds[p];
        in_place = in_place && (kinds[p] == UNIT || kinds[p] == HOISTED);
        for (int q = part->first + part->rank; q-- > part->first; row_step *= part->shape[q - part->first]) {
            cores[q] = kinds[p] == SAME || kinds[p] == ANY ? row_step : strides[q];
            row_cores[q] = row_step;
        }
        if (kinds[p] == HOISTED || kinds[p] == UNIT)
            continue;
        starts[p] = (char *)rows[p];
        loads[p] = spans ? GAC(spans)[part->size].load[width] : NULL;
        stores[p] = spans ? GAC(spans)[part->size].store[width] : NULL;
        if (kinds[p] == SAME)
            GAC(move_part)(0, rows[p], row, part, args[p], 0, strides + part->first, n < row ? PADDED(n) : row);
    }
    const intptr_t turn = near ? SPAN : LANES;
    intptr_t i = 0;
    // Elements in C order, by functions that are specialized for the sizes.
    for (; spans && !in_place && n - i >= turn; i += turn) {
        for (int p = 0; p < n_parts; ++p) {
            if (kinds[p] == UNIT)
                starts[p] = args[p] + i * w;
            else if (kinds[p] == ANY && p < n_inputs)
                loads[p](turn, (char *[]){starts[p], args[p] + i * steps[p]}, NULL);
        }
        for (int p = 0; !near && p < n_parts; ++p) {
            const intptr_t first = p < n_inputs ? i + turn : i, count = n - first < turn ? n - first : turn;
            if (kinds[p] == ANY)
                gac_fetch(args[p] + first * steps[p], count * steps[p], p >= n_inputs);
        }
        in_rows(turn, starts, cores);
        for (int p = n_inputs; p < n_parts; ++p)
            if (kinds[p] == ANY)
                stores[p](turn, (char *[]){starts[p], args[p] + i * steps[p]}, NULL);
    }
    for (intptr_t m; i < n; i += m) {
        m = i < head ? head - i : n - i < LANES ? n - i : in_place || n - i < row ? (n - i) & -LANES : row;
        const int few = m < LANES;
        for (int p = 0; p < n_parts; ++p) {
            const struct gac_part *part = &kernel->parts[p];
            const int lies = kinds[p] == UNIT && !few;
            if (kinds[p] < UNIT)
                continue;
            starts[p] = lies ? args[p] + i * w : (char *)rows[p];
            for (int q = part->first; q < part->first + part->rank; ++q)
                cores[q] = lies ? strides[q] : row_cores[q];
            if (lies)
                continue;
            if (p < n_inputs)
                GAC(move_part)(0, rows[p], row, part, args[p] + i * steps[p], steps[p], strides + part->first, m);
            for (intptr_t k = 0; few && p < n_inputs && k < part->size; ++k)
                for (intptr_t j = m; j < LANES; ++j)
                    rows[p][k * row + j] = rows[p][k * row + m - 1];
        }
        in_rows(m, starts, cores);
        for (int p = n_inputs; p < n_parts; ++p) {
            const struct gac_part *part = &kernel->parts[p];
            char *to = args[p] + i * steps[p];
            if (past)
                GAC(stream_part)(rows[p], row, part, to, strides + part->first, m);
            else if (starts[p] == (char *)rows[p])
                GAC(move_part)(1, rows[p], row, part, to, steps[p], strides + part->first, m);
        }
    }
    if (past)
        STREAM_END();
}

// The same for a kernel that exceeds one of the usual limits.
static void GAC(large_batch)(intptr_t n_prepared, const struct gac_kernel *kernel, char **args, intptr_t n,
    const intptr_t *steps, int width)
{
    const int n_parts = kernel->n_parts, n_cores = kernel->n_cores + 1, line = LINE / sizeof(REAL);
    const intptr_t least = (intptr_t)kernel->n_numbers * LANES, n_space = least > SPACE ? least : SPACE;
    REAL memory[n_space + n_prepared + line];
    REAL *const space = memory + (-(intptr_t)memory & (LINE - 1)) / sizeof(REAL);
    enum kind kinds[n_parts];
    gac_loop *loads[n_parts], *stores[n_parts];
    REAL *rows[n_parts];
    char *starts[n_parts], *rest[n_parts];
    intptr_t cores[n_cores], row_cores[n_cores];
    GAC(batch_in)(space, n_space, space + n_space, kinds, loads, stores, rows, starts, rest, cores, row_cores, kernel,
        args, n, steps, width);
}

void GAC(batch)(const struct gac_kernel *kernel, char **args, intptr_t n, const intptr_t *steps)
{
    const int width = CHOSEN;
    intptr_t n_prepared = 0;
    if (width < 0 || n <= 1) {
        GAC(each)(kernel, args, n, steps);
        return;
    }
    for (int f = 0; f < kernel->n_forms; ++f)
        if (kernel->forms[f].n_prepared > n_prepared)
            n_prepared = kernel->forms[f].n_prepared;
    if (kernel->n_parts > USUAL_PARTS || kernel->n_cores > USUAL_CORES || kernel->n_numbers > USUAL_NUMBERS ||
        n_prepared > USUAL_PREPARED) {
        GAC(large_batch)(n_prepared, kernel, args, n, steps, width);
        return;
    }
    _Alignas(LINE) REAL space[SPACE], prepared[USUAL_PREPARED];
    enum kind kinds[USUAL_PARTS];
    gac_loop *loads[USUAL_PARTS], *stores[USUAL_PARTS];
    REAL *rows[USUAL_PARTS];
    char *starts[USUAL_PARTS], *rest[USUAL_PARTS];
    intptr_t cores[USUAL_CORES], row_cores[USUAL_CORES];
    GAC(batch_in)(space, SPACE, prepared, kinds, loads, stores, rows, starts, rest, cores, row_cores, kernel, args, n,
        steps, width);
}

#endif

#ifdef GAC_PART_ROWS
// Run a kernel with loops on one element after the other; the table after its arguments and results is its work space.
static void GAC(rows_alone)(const struct gac_procedure *procedure, const intptr_t *lengths, char **args,
    const intptr_t *steps, intptr_t first, intptr_t n, char **starts, REAL *work)
{
    starts[procedure->n_args] = (char *)work;
    for (intptr_t i = first; i < first + n; ++i) {
        for (int p = 0; p < procedure->n_args; ++p)
            starts[p] = args[p] + i * steps[p];
        procedure->one(lengths, starts);
    }
}

// Copy numbers of `n` elements, `s` bytes apart, to adjacent lanes, or back.
static void GAC(move_some)(int back, REAL *x, char *a, intptr_t s, intptr_t count, intptr_t n)
{
    if (back)
        GAC(store_rows)(a, s, sizeof(REAL), x, NLANES, count, n);
    else
        GAC(load_rows)(x, NLANES, a, s, sizeof(REAL), count, n);
}

// The same for all lanes. If there are fewer elements, the second half of the lanes has the last elements, which may
// also be in the first half; or all remaining lanes have the last element.
static void GAC(move_lanes)(int back, REAL *x, char *a, intptr_t s, intptr_t count, intptr_t n)
{
    const intptr_t half = NLANES / 2;
    if (n < NLANES && n >= half) {
        GAC(move_some)(back, x, a, s, count, half);
        GAC(move_some)(back, x + half, a + (n - half) * s, s, count, half);
        return;
    }
    GAC(move_some)(back, x, a, s, count, n);
    for (intptr_t k = 0; n < half && !back && k < count; ++k)
        for (intptr_t i = n; i < NLANES; ++i)
            x[k * NLANES + i] = x[k * NLANES + n - 1];
}

// Run a kernel with loops on at most NLANES elements at a time, from the first on, and return the number done.
static intptr_t GAC(rows_in_lanes)(const struct gac_procedure *procedure, const struct gac_table *tables,
    const intptr_t *lengths, char **args, const intptr_t *steps, intptr_t n, char **starts, char **rows, REAL *work,
    gac_loop *lanes, intptr_t least)
{
    WORD far;
    rows[procedure->n_tables] = (char *)&far;
    intptr_t done = 0;
    for (intptr_t m; n - done >= least; done += m) {
        m = n - done < NLANES ? n - done : NLANES;
        for (int p = 0; p < procedure->n_args; ++p) {
            const intptr_t count = tables[p].count;
            REAL *const x = (REAL *)rows[p];
            if (tables[p].kind != GAC_IS_IN || (done && !steps[p]))
                continue;
            GAC(move_lanes)(0, x, args[p] + done * steps[p], steps[p], count, steps[p] ? m : NLANES);
        }
        far = 0;
        lanes(procedure->n_tables, rows, lengths);
        if (far) {
            GAC(rows_alone)(procedure, lengths, args, steps, done, m, starts, work);
            continue;
        }
        for (int p = 0; p < procedure->n_args; ++p)
            if (tables[p].kind == GAC_IS_OUT)
                GAC(move_lanes)(1, (REAL *)rows[p], args[p] + done * steps[p], steps[p], tables[p].count, m);
    }
    return done;
}

int GAC(rows)(const struct gac_procedure *procedure, const struct gac_table *tables, const intptr_t *lengths,
    char **args, const intptr_t *steps, intptr_t n)
{
    const int width = CHOSEN, n_tables = procedure->n_tables, line = LINE / sizeof(REAL);
    const intptr_t least = procedure->busy ? 3 : NLANES / 2 + 2;
    int in_lanes = width >= 0 && n >= least && procedure->lanes[0];
    intptr_t alone = 0, together = 0;
    for (int p = 0; p < n_tables; ++p) {
        if (tables[p].kind == GAC_IS_WORK)
            alone += tables[p].count;
        else if (tables[p].kind == GAC_IS_SAME && steps[p])
            in_lanes = 0;
        if (tables[p].kind != GAC_IS_SAME && tables[p].kind != GAC_IS_INDEX)
            together += tables[p].count * NLANES + line;
    }
    // One cache line between tables, so that their rows do not map to the same cache sets.
    const intptr_t needed = alone + (in_lanes ? together + line : 0);
    _Alignas(LINE) REAL near[SPACE];
    REAL *const memory = needed > SPACE ? malloc((needed + line) * sizeof(REAL)) : near;
    if (!memory)
        return 1;
    char *starts[n_tables + 1];
    intptr_t done = 0;
    if (in_lanes) {
        REAL *next = memory + (-(intptr_t)memory & (LINE - 1)) / (intptr_t)sizeof(REAL);
        char *rows[n_tables + 1];
        for (int p = 0; p < n_tables; ++p) {
            if (tables[p].kind == GAC_IS_SAME || tables[p].kind == GAC_IS_INDEX) {
                rows[p] = args[p];
                continue;
            }
            rows[p] = (char *)next;
            next += tables[p].count * NLANES + line;
        }
        done = GAC(rows_in_lanes)(procedure, tables, lengths, args, steps, n, starts, rows, next,
            procedure->lanes[width], least);
    }
    GAC(rows_alone)(procedure, lengths, args, steps, done, n - done, starts, memory);
    if (memory != near)
        free(memory);
    return 0;
}
#endif
#endif
