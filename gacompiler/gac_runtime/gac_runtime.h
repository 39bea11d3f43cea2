/* The runtime that generated C modules share: what a module's .c includes.

   A generated module is `my_kernels.c` and `my_kernels.h`; a C program compiles it together with the runtime,

       cc -std=c17 -O2 -ffp-contract=off my_program.c my_kernels.c gac_runtime/gac_runtime.c -lm

   and includes `my_kernels.h` only. With -ffp-contract=off every operation is rounded once, as the operation counts and
   error bounds of the headers assume.
   A program that calls only functions of single elements, with or without loops, can be compiled with
   -DGAC_ONLY_ELEMENTS, which leaves out all functions of batches, and without gac_runtime.c.

   A module consists of one plain function for each kernel, and of uses of the macros below, which generate loops over
   batches from them. Code that depends on the precision is written once: a file includes itself with REAL defined as
   double and then as float. Names of the runtime begin with `gac_`; macros without this prefix are used in the bodies
   of kernels.

   Limits: a part of an element has at most GAC_MOST_AXES axes. Kernels may have any number of parts; only the first
   GAC_FLAGS arguments are considered in forms for uniform arguments. */

#ifndef REAL
#ifndef GAC_RUNTIME_H
#define GAC_RUNTIME_H

/* The version of this interface; each module states the version for which it was generated. */
#define GAC_RUNTIME_INTERFACE 1

#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(__GNUC__)
#define INLINE inline __attribute__((always_inline))
#define GAC_HELPER static inline __attribute__((always_inline, unused))
#define GAC_LOCAL static inline __attribute__((unused))
#else
#define INLINE inline
#define GAC_HELPER static inline
#define GAC_LOCAL static inline
#endif

/* Functions of the runtime are not visible outside of the library that they are linked into; if a file contains the
   whole runtime, they are static. */
#if defined(GAC_STANDALONE) && defined(__GNUC__)
#define GAC_SHARED static __attribute__((unused))
#elif defined(GAC_STANDALONE)
#define GAC_SHARED static
#elif defined(__GNUC__) && !defined(_WIN32)
#define GAC_SHARED __attribute__((visibility("hidden")))
#else
#define GAC_SHARED
#endif

/* Elements are independent: an output may overlap only with inputs of the same element. */
#if defined(__clang__)
#define ANY_ORDER _Pragma("clang loop vectorize(assume_safety)")
#define NOT_UNROLLED _Pragma("clang loop unroll(disable)")
#elif defined(__GNUC__)
#define ANY_ORDER _Pragma("GCC ivdep")
#define NOT_UNROLLED _Pragma("GCC unroll 1")
#else
#define ANY_ORDER
#define NOT_UNROLLED
#endif

/* Loops use the widest vectors of the machine on which they run. On x86-64 each loop is compiled for AVX2 (v3) and for
   AVX-512 (v4), and machines with neither run one element after the other; on other machines it is compiled once.
   Define GAC_ONE_WIDTH to compile each loop once on all machines. Define GAC_LEVEL as 1, 3 or 4 to compile for machines
   of this level of x86-64 only, in two thirds of the time; levels 3 and 4 need compiler options for AVX2, FMA and
   BMI2. */
#if defined(__x86_64__) && defined(__GNUC__) && !defined(_WIN32) && !defined(GAC_ONE_WIDTH)
#if __GNUC__ >= 12 && !defined(__clang__)
#define ON_v3 __attribute__((target("arch=x86-64-v3")))
#define ON_v4 __attribute__((target("arch=x86-64-v4")))
#define HAS_v3 __builtin_cpu_supports("x86-64-v3")
#define HAS_v4 __builtin_cpu_supports("x86-64-v4")
#define NAMES_MACHINES
#else
#define ON_v3 __attribute__((target("avx2,fma,bmi2")))
#define ON_v4 __attribute__((target("avx2,fma,bmi2,avx512f,avx512bw,avx512dq,avx512vl")))
#define FINDS(feature) __builtin_cpu_supports(feature)
#if defined(__AVX2__) && defined(__FMA__) && defined(__BMI2__) && !defined(GAC_LEVEL)
#define HAS_v3 1
#else
#define HAS_v3 (FINDS("avx2") && FINDS("fma") && FINDS("bmi2"))
#endif
#define HAS_v4 (HAS_v3 && FINDS("avx512f") && FINDS("avx512bw") && FINDS("avx512dq") && FINDS("avx512vl"))
#endif
#endif

/* A loop is a function that begins with GAC_HEAD, or with GAC_HEAD_v3 if vectors wider than those of AVX2 do not make
   it faster. After its body, LOOPS or LOOP compiles it for each width if there are several. WIDTHS or WIDTH lists these
   functions in tables, and CHOSEN is the index of the function for this machine, -1 if there is none. GAC_WIDE_LOOP is
   the storage of a loop for the widest vectors, and GAC_WIDE_PART that of the functions that it calls. If they are
   compiled once, the compiler inlines a part only if it is small or called once. */
#define GAC_LOOP_HEAD(storage, name) storage void NAME(name)(intptr_t n, char **args, const intptr_t *strides)
#define GAC_HEAD(name) GAC_LOOP_HEAD(GAC_WIDE_LOOP, name)
#if defined(ON_v3) && !defined(GAC_LEVEL)
#define GAC_FOR(level, function, name)                                                      \
    ON_##level static void name(intptr_t n, char **args, const intptr_t *strides)            \
    {                                                                                       \
        function(n, args, strides);                                                         \
    }
#define GAC_WIDE_LOOP static INLINE
#define GAC_WIDE_PART GAC_HELPER
#define GAC_HEAD_v3(name) GAC_LOOP_HEAD(static INLINE, name)
#define LOOP(name) GAC_FOR(v3, NAME(name), NAME(name##_v3))
#define LOOPS(name) GAC_FOR(v3, NAME(name), NAME(name##_v3)) GAC_FOR(v4, NAME(name), NAME(name##_v4))
#define WIDTH(name) {NAME(name##_v3), NAME(name##_v3)}
#define WIDTHS(name) {NAME(name##_v3), NAME(name##_v4)}
#define CHOSEN (HAS_v4 ? 1 : HAS_v3 ? 0 : -1)
#else
#define LOOP(name)
#define LOOPS(name)
#if defined(ON_v3) && GAC_LEVEL < 3
#define GAC_WIDE_LOOP static INLINE
#define GAC_WIDE_PART GAC_HELPER
#define GAC_HEAD_v3(name) GAC_LOOP_HEAD(static INLINE, name)
#define WIDTH(name) {NULL}
#define WIDTHS(name) {NULL}
#define CHOSEN -1
#else
#if defined(ON_v4) && GAC_LEVEL >= 4
#define GAC_WIDE_LOOP ON_v4 static
#define GAC_WIDE_PART ON_v4 GAC_LOCAL
#else
#define GAC_WIDE_LOOP static
#define GAC_WIDE_PART GAC_LOCAL
#endif
#define GAC_HEAD_v3(name) GAC_LOOP_HEAD(static, name)
#define WIDTH(name) {NAME(name)}
#define WIDTHS(name) {NAME(name)}
#define CHOSEN 0
#endif
#endif

/* A plain function with transcendental functions. Its body is a separate function, which loops call, because these
   functions use fused multiply-add: an instruction on machines with AVX2, and a library call on others. */
#if defined(ON_v3) && !defined(GAC_LEVEL)
#define FUSED(name, parameters, within) ON_v3 static void NAME(name##_v3) parameters { NAME(name##_within) within; }
#define RUN(name, arguments, within)        \
    do {                                    \
        if (HAS_v3)                         \
            NAME(name##_v3) arguments;      \
        else                                \
            NAME(name##_within) within;     \
    } while (0)
#else
#define FUSED(name, parameters, within)
#define RUN(name, arguments, within) NAME(name##_within) within
#endif

/* Loops run over whole vectors: a block is padded to a multiple of LANES elements. A block with an argument that is too
   large for the vectorised sines is computed again, in pieces of CHUNK elements. Elements in C order are copied through
   rows of SPAN. TILE elements fill 32 bytes, which all machines with vectors transpose in the same manner. */
#define LANES 16
#define PADDED(n) (((n) + LANES - 1) & -LANES)
#define CHUNK 64
#define SPAN 32
#define TILE PRECISION(4, 8)

/* Kernels with loops run NLANES elements in parallel, so that one number of each fills a cache line. With more elements
   the tables of a block would exceed the caches earlier. */
#define NLANES PRECISION(8, 16)

/* A vector of consecutive numbers, for compilers that transpose vectors of 32 bytes efficiently. */
#if defined(__has_builtin) && (defined(ON_v3) || defined(__clang__))
#if __has_builtin(__builtin_shufflevector)
#define SHUFFLE __builtin_shufflevector
#define VECTOR(n) __attribute__((vector_size((n) * sizeof(REAL)), aligned(sizeof(REAL)), may_alias))
#endif
#endif

#define GAC_MOST_AXES 5
#define GAC_FLAGS 32

/* An argument or a result: its number of components, number of axes, index of its first stride, and shape. */
struct gac_part {
    int size, rank, first, shape[GAC_MOST_AXES];
};

typedef void gac_loop(intptr_t n, char **args, const intptr_t *strides);
typedef void gac_function(void);

/* A form of a kernel for batches in which the arguments in the bit mask `same` are equal for at least `least` elements.
   `n_prepared` numbers that depend on these arguments are computed once, and replace the first of them. */
struct gac_form {
    unsigned same;
    intptr_t least, n_prepared;
    void (*start)(char **args, const intptr_t *strides, void *prepared);
    gac_loop *block[2], *dense[2];
    int together;
};

/* A kernel: its loops over rows and in C order (which process `together` elements at a time), its plain function and
   the function that calls it, its parts with their total numbers of strides and components, and its forms. A kernel
   that `repeats` reads inputs after it has written outputs, so that these must not overlap. A `busy` kernel computes
   transcendental functions. */
struct gac_kernel {
    gac_loop *block[2], *dense[2];
    int together;
    gac_function *function;
    void (*call)(gac_function *function, void **parts);
    int n_inputs, n_parts, n_cores, n_numbers, n_forms, repeats, busy;
    const struct gac_part *parts;
    const struct gac_form *forms;
};

/* Run a kernel over a batch. Arrays with unit stride and hoisted arguments are used in place, and so is a whole batch
   in C order if there is a loop for it. All other arrays are copied through rows, in blocks. */
GAC_SHARED void gac_batch_f64(const struct gac_kernel *kernel, char **args, intptr_t n, const intptr_t *steps);
GAC_SHARED void gac_batch_f32(const struct gac_kernel *kernel, char **args, intptr_t n, const intptr_t *steps);

/* A table of a kernel with loops: an argument of each element, an argument that may be shared by a batch, an index
   table, a result or work space; `count` is its size for one element. */
struct gac_table {
    enum { GAC_IS_IN, GAC_IS_SAME, GAC_IS_INDEX, GAC_IS_OUT, GAC_IS_WORK } kind;
    intptr_t count;
};

/* A kernel with loops: the function that runs one element, the loops that process NLANES elements at a time (or NULL),
   the number of arguments and results, the number of tables, and whether it is `busy`. The loops take the addresses of
   tables, in which corresponding numbers of elements are adjacent, and of a word that they set if an argument of a sine
   or cosine was too large. */
struct gac_procedure {
    void (*one)(const intptr_t *lengths, char **args);
    gac_loop *lanes[2];
    int n_args, n_tables, busy;
};

/* Run a kernel with loops over a batch. Return 1 if memory cannot be allocated, else 0. */
GAC_SHARED int gac_rows_f64(const struct gac_procedure *procedure, const struct gac_table *tables,
    const intptr_t *lengths, char **args, const intptr_t *steps, intptr_t n);
GAC_SHARED int gac_rows_f32(const struct gac_procedure *procedure, const struct gac_table *tables,
    const intptr_t *lengths, char **args, const intptr_t *steps, intptr_t n);

/* Words as wide as a number. Conditions in transcendental functions are masks, because compilers would turn frequent
   conditions into branches. */
#define WORD PRECISION(uint64_t, uint32_t)
#define FUNCTION(name) PRECISION(name, name##f)
#define GAC(name) PRECISION(gac_##name##_f64, gac_##name##_f32)
#define SIGN_BIT PRECISION(63, 31)
#define SIGN ((WORD)1 << SIGN_BIT)
#define WHERE(condition) ((WORD)0 - (WORD)(condition))

/* The operations of kernels. Minimum and maximum are NaN where either operand is NaN. */
#define SQRT(x) FUNCTION(sqrt)(x)
#define SIN(x) GAC(sin)(x, far)
#define COS(x) GAC(cos)(x, far)
#define ATAN2(y, x) GAC(atan2)(y, x)
#define ACOS(x) GAC(acos)(x)
#define EXP(x) GAC(exp)(x)
#define LOG(x) GAC(log)(x)
#define ABS(x) FUNCTION(fabs)(x)
#define FLOOR(x) FUNCTION(floor)(x)
#define MINIMUM(a, b) GAC(minimum)(a, b)
#define MAXIMUM(a, b) GAC(maximum)(a, b)
#define LESS(a, b) ((REAL)((a) < (b)))
#define LESS_EQUAL(a, b) ((REAL)((a) <= (b)))
#define EQUAL(a, b) ((REAL)((a) == (b)))
#define SELECT(condition, a, b) GAC(choose)((condition) != 0, a, b)

/* A fused multiply-add, which is rounded once. */
#define FMA(a, b, c) FUNCTION(fma)(a, b, c)

/* Constants of the transcendental functions: a number so large that the last bits of its sum with an integer up to half
   a million are that integer, and pi/2 and log(2) as sums in which each part is nearest to the remainder of the parts
   before. */
#define SHIFT PRECISION(6755399441055744.0, 12582912.0f)
#define QUARTER_0 PRECISION(1.5707963267948966, 1.5707963705062866f)
#define QUARTER_1 PRECISION(6.123233995736766e-17, -4.371138828673793e-08f)
#define QUARTER_2 PRECISION(-1.4973849048591698e-33, -1.7151245100058819e-15f)
#define QUARTER_INVERSE PRECISION(0.6366197723675814, 0.6366197466850281f)
#define LOG_0 PRECISION(0.6931471805599453, 0.6931471824645996f)
#define LOG_1 PRECISION(2.3190468138462996e-17, -1.9046542121259336e-09f)
#define LOG_INVERSE PRECISION(1.4426950408889634, 1.4426950216293335f)

#define FRACTION_BITS PRECISION(52, 23)
#define BIAS PRECISION(1023, 127)

/* Sines and cosines of larger arguments are computed by the C library. Up to this limit multiples of pi/2 have 16 bits,
   so that three parts of pi/2 are enough. */
#define GAC_FARTHEST 65536

/* Polynomials, evaluated in two halves that processors compute in parallel. backends/approximations.py computes their
   coefficients. */
static INLINE double gac_sin_polynomial_f64(double z)
{
    const double y = z * z;
    const double even = fma(y, fma(y, -2.5051131845003624e-08, -0.00019841269836758574), -0.16666666666666666);
    const double odd = fma(y, fma(y, 1.5918129294866608e-10, 2.755731610255244e-06), 0.008333333333330948);
    return fma(z, odd, even);
}

static INLINE double gac_cos_polynomial_f64(double z)
{
    const double y = z * z;
    const double even = fma(y, fma(y, 2.08761462684032e-09, 2.480158729876569e-05), 0.041666666666666664);
    const double odd = fma(y, fma(y, -1.1382632425521717e-11, -2.7557317271729793e-07), -0.0013888888888887398);
    return fma(z, odd, even);
}

static INLINE double gac_exp_polynomial_f64(double z)
{
    const double y = z * z;
    const double even = fma(y, fma(y, fma(y, fma(y, 2.7620075879983367e-07, 2.4801521322368692e-05),
        0.0013888888917196719), 0.041666666666624164), 0.5000000000000001);
    const double odd = fma(y, fma(y, fma(y, fma(y, 2.5100375832561234e-08, 2.7557268480310024e-06),
        0.00019841269863040545), 0.008333333333330065), 0.16666666666666669);
    return fma(z, odd, even);
}

static INLINE double gac_log_polynomial_f64(double z)
{
    const double y = z * z;
    const double even = fma(y, fma(y, fma(y, 0.14616449685043406, 0.18182889125261723), 0.28571428625975487),
        0.666666666666667);
    const double odd = fma(y, fma(y, 0.15331721600556042, 0.2222221113479508), 0.39999999999899505);
    return fma(z, odd, even);
}

static INLINE double gac_atan_polynomial_f64(double z)
{
    const double y = z * z;
    const double even = fma(y, fma(y, fma(y, fma(y, fma(y, fma(y, fma(y, fma(y, fma(y, -2.8373324902198374e-05,
        -3.504433556095341e-05), -0.00010789905799306997), -0.0002713884068435811), -0.000712529877324769),
        -0.0019209389488175712), -0.005394792734515503), -0.016172974900145312), -0.054814840604579904),
        -0.2591604972657936);
    const double odd = fma(y, fma(y, fma(y, fma(y, fma(y, fma(y, fma(y, fma(y, fma(y, 1.806195461861215e-05,
        2.2095024431396628e-05), 6.77580169120214e-05), 0.00016895422802807932), 0.0004387712318266148),
        0.0011650648417818904), 0.0031991751955030576), 0.009243096224092707), 0.029135862645225958),
        0.11081482513071414);
    return fma(z, odd, even);
}

static INLINE double gac_asin_polynomial_f64(double z)
{
    const double y = z * z;
    const double even = fma(y, fma(y, fma(y, fma(y, fma(y, fma(y, 0.028757851367421566, 0.01740087944269402),
        0.01032281435018578), 0.013971212973552933), 0.02237217294214989), 0.04464285714635543),
        0.16666666666666669);
    const double odd = fma(y, fma(y, fma(y, fma(y, fma(y, -0.014851887071247204, 0.005457506718640358),
        0.011479177415184906), 0.017352392720869973), 0.030381944138531247), 0.07499999999998433);
    return fma(z, odd, even);
}

static INLINE float gac_sin_polynomial_f32(float z)
{
    const float y = z * z;
    const float even = fmaf(y, (float)-0.00019587890710681677, (float)-0.166666641831398);
    const float odd = (float)0.008332747966051102;
    return fmaf(z, odd, even);
}

static INLINE float gac_cos_polynomial_f32(float z)
{
    const float y = z * z;
    const float even = fmaf(y, (float)2.454794230288826e-05, (float)0.0416666641831398);
    const float odd = (float)-0.001388830249197781;
    return fmaf(z, odd, even);
}

static INLINE float gac_exp_polynomial_f32(float z)
{
    const float y = z * z;
    const float even = fmaf(y, fmaf(y, (float)0.0013926175888627768, (float)0.041666556149721146), (float)0.5);
    const float odd = fmaf(y, (float)0.008363173343241215, (float)0.16666577756404877);
    return fmaf(z, odd, even);
}

static INLINE float gac_log_polynomial_f32(float z)
{
    const float y = z * z;
    const float even = fmaf(y, (float)0.29579949378967285, (float)0.6666668653488159);
    const float odd = (float)0.3998878002166748;
    return fmaf(z, odd, even);
}

static INLINE float gac_atan_polynomial_f32(float z)
{
    const float y = z * z;
    const float even = fmaf(y, fmaf(y, fmaf(y, fmaf(y, (float)-0.0023869972210377455, (float)-0.00530332000926137),
        (float)-0.01617945171892643), (float)-0.054814718663692474), (float)-0.25916048884391785);
    const float odd = fmaf(y, fmaf(y, fmaf(y, (float)0.00395978195592761, (float)0.009093896485865116),
        (float)0.029146425426006317), (float)0.11081462353467941);
    return fmaf(z, odd, even);
}

static INLINE float gac_asin_polynomial_f32(float z)
{
    const float y = z * z;
    const float even = fmaf(y, fmaf(y, (float)0.017149237915873528, (float)0.04459940269589424),
        (float)0.1666666567325592);
    const float odd = fmaf(y, fmaf(y, (float)0.03369084745645523, (float)0.031100662425160408),
        (float)0.07500094175338745);
    return fmaf(z, odd, even);
}

/* Statements M(k, ...) for k from 0 up to, but not including, a power of two. */
#define GAC_TIMES_1(M, k, ...) M(k, __VA_ARGS__)
#define GAC_TIMES_2(M, k, ...) GAC_TIMES_1(M, k, __VA_ARGS__) GAC_TIMES_1(M, (k) + 1, __VA_ARGS__)
#define GAC_TIMES_4(M, k, ...) GAC_TIMES_2(M, k, __VA_ARGS__) GAC_TIMES_2(M, (k) + 2, __VA_ARGS__)
#define GAC_TIMES_8(M, k, ...) GAC_TIMES_4(M, k, __VA_ARGS__) GAC_TIMES_4(M, (k) + 4, __VA_ARGS__)
#define GAC_TIMES_16(M, k, ...) GAC_TIMES_8(M, k, __VA_ARGS__) GAC_TIMES_8(M, (k) + 8, __VA_ARGS__)
#define GAC_TIMES_32(M, k, ...) GAC_TIMES_16(M, k, __VA_ARGS__) GAC_TIMES_16(M, (k) + 16, __VA_ARGS__)
#define GAC_TIMES_64(M, k, ...) GAC_TIMES_32(M, k, __VA_ARGS__) GAC_TIMES_32(M, (k) + 32, __VA_ARGS__)
#define GAC_TIMES_128(M, k, ...) GAC_TIMES_64(M, k, __VA_ARGS__) GAC_TIMES_64(M, (k) + 64, __VA_ARGS__)
#define GAC_TIMES_256(M, k, ...) GAC_TIMES_128(M, k, __VA_ARGS__) GAC_TIMES_128(M, (k) + 128, __VA_ARGS__)
#define GAC_TIMES_512(M, k, ...) GAC_TIMES_256(M, k, __VA_ARGS__) GAC_TIMES_256(M, (k) + 256, __VA_ARGS__)
#define GAC_TIMES_1024(M, k, ...) GAC_TIMES_512(M, k, __VA_ARGS__) GAC_TIMES_512(M, (k) + 512, __VA_ARGS__)

/* Load and store the parts of an element with arbitrary strides. GAC_AXIS(n, power) is for parts of `n` numbers along
   one axis, GAC_AXES(shape, n, power, inner, size) for `n` parts of the shape `inner`, which has `size` numbers;
   `power` is a power of two not less than `n`. Every load is a separate statement, since compilers vectorise innermost
   loops only. */
#define GAC_AXIS(length, power)                                                     \
    GAC_HELPER void GAC(load_##length)(REAL *x, const char *a, const intptr_t *c)    \
    {                                                                               \
        GAC_TIMES_##power(GAC_LOAD_NUMBER, 0, length)                               \
    }                                                                               \
    GAC_HELPER void GAC(store_##length)(char *a, const intptr_t *c, const REAL *x)   \
    {                                                                               \
        GAC_TIMES_##power(GAC_STORE_NUMBER, 0, length)                              \
    }
#define GAC_AXES(shape, length, power, inner, size)                                 \
    GAC_HELPER void GAC(load_##shape)(REAL *x, const char *a, const intptr_t *c)     \
    {                                                                               \
        GAC_TIMES_##power(GAC_LOAD_INNER, 0, length, inner, size)                   \
    }                                                                               \
    GAC_HELPER void GAC(store_##shape)(char *a, const intptr_t *c, const REAL *x)    \
    {                                                                               \
        GAC_TIMES_##power(GAC_STORE_INNER, 0, length, inner, size)                  \
    }
#define GAC_LOAD_NUMBER(k, n)     \
    if ((k) < n)                  \
        x[k] = *(const REAL *)(a + (k) * c[0]);
#define GAC_STORE_NUMBER(k, n)    \
    if ((k) < n)                  \
        *(REAL *)(a + (k) * c[0]) = x[k];
#define GAC_LOAD_INNER(k, n, inner, size)  \
    if ((k) < n)                           \
        GAC(load_##inner)(x + (k) * (size), a + (k) * c[0], c + 1);
#define GAC_STORE_INNER(k, n, inner, size) \
    if ((k) < n)                           \
        GAC(store_##inner)(a + (k) * c[0], c + 1, x + (k) * (size));

/* The loops of a kernel are generated from the list of its parts. This is a macro that takes the names of macros for an
   array, a number and a result, and the separator,

       #define PARTS_f(IN, NUMBER, OUT, AND) IN(0, 0, 8, 8, 1, 8) AND NUMBER(1, 1) AND OUT(2, 1, 2x3, 6, 2, 2, 3)

   The arguments of each are its index among the parts and the index of its first stride; arrays and results also have
   the name of their shape, their numbers of components and axes, and the lengths of the axes. */
#define GAC_COMMA ,
#define GAC_NONE(...)

/* Load the components of an element into local variables, and call the plain function. */
#define GAC_VARIABLE(k, at, shape, size, ...) REAL x##k[size];
#define GAC_VARIABLE_NUMBER(k, at) REAL x##k[1];
#define GAC_PASSED(k, ...) x##k
#define GAC_PASSED_NUMBER(k, at) x##k[0]
#define GAC_PASS(parts) parts(GAC_PASSED, GAC_PASSED_NUMBER, GAC_PASSED, GAC_COMMA)
#define GAC_ELEMENT(parts, order, call)                                             \
    parts(GAC_VARIABLE, GAC_VARIABLE_NUMBER, GAC_VARIABLE, )                        \
    parts(GAC_LOAD_##order, GAC_LOAD_##order##_NUMBER, GAC_NONE, )                  \
    call;                                                                           \
    parts(GAC_NONE, GAC_NONE, GAC_STORE_##order, )

#define GAC_PREPARED(first) const REAL *prepared = (const REAL *)args[first];

/* Loops over rows: each component has unit stride over the elements of a block. */
#define GAC_CORE(k, at, rank) (rank) > k ? strides[(at) + k] : 0
#define GAC_CORES(at, rank)                                                                                     \
    {                                                                                                           \
        GAC_CORE(0, at, rank), GAC_CORE(1, at, rank), GAC_CORE(2, at, rank), GAC_CORE(3, at, rank),             \
        GAC_CORE(4, at, rank)                                                                                   \
    }
#define GAC_ROWS(k, at, shape, size, rank, ...)                                     \
    char *const a##k = args[k];                                                     \
    const intptr_t c##k[GAC_MOST_AXES] = GAC_CORES(at, rank);
#define GAC_ROWS_NUMBER(k, at) char *const a##k = args[k];
#define GAC_LOAD_ROWS(k, at, shape, ...) GAC(load_##shape)(x##k, a##k + i * w, c##k);
#define GAC_LOAD_ROWS_NUMBER(k, at) x##k[0] = *(const REAL *)(a##k + i * w);
#define GAC_STORE_ROWS(k, at, shape, ...) GAC(store_##shape)(a##k + i * w, c##k, x##k);
#define GAC_BLOCK(name, parts, setup, call)                                         \
    GAC_HEAD(name)                                                                  \
    {                                                                               \
        const intptr_t w = sizeof(REAL);                                            \
        (void)strides;                                                              \
        setup                                                                       \
        parts(GAC_ROWS, GAC_ROWS_NUMBER, GAC_ROWS, )                                \
        ANY_ORDER                                                                   \
        for (intptr_t i = 0; i < PADDED(n); ++i) {                                  \
            GAC_ELEMENT(parts, ROWS, call)                                          \
        }                                                                           \
    }                                                                               \
    LOOPS(name)

/* The same for a function with sines or cosines. It only sets a flag if an argument is too large; another loop computes
   these elements. */
#define GAC_BLOCK_TWICE(name, parts, setup, call, again)                            \
    GAC_HEAD(name)                                                                  \
    {                                                                               \
        const intptr_t w = sizeof(REAL);                                            \
        (void)strides;                                                              \
        setup                                                                       \
        parts(GAC_ROWS, GAC_ROWS_NUMBER, GAC_ROWS, )                                \
        for (intptr_t first = 0; first < n; first += CHUNK) {                       \
            const intptr_t last = first + CHUNK < n ? first + CHUNK : PADDED(n);    \
            WORD far = 0;                                                           \
            ANY_ORDER                                                               \
            for (intptr_t i = first; i < last; ++i) {                               \
                GAC_ELEMENT(parts, ROWS, call)                                      \
            }                                                                       \
            for (intptr_t i = first; far && i < last; ++i) {                        \
                GAC_ELEMENT(parts, ROWS, again)                                     \
            }                                                                       \
        }                                                                           \
    }                                                                               \
    LOOPS(name)

/* Loops in C order, in tiles: vectors of as many elements as fill 32 bytes. The inner loop is one step of vectors,
   which are kept in registers; wider vectors would need more steps for the transposition and would not be faster. */
#define GAC_TILES(k, at, shape, size, ...)                                          \
    REAL *const a##k = (REAL *)args[k];                                             \
    _Alignas(64) REAL r##k[(size) * TILE];
#define GAC_TILES_NUMBER(k, at) GAC_TILES(k, at, 1, 1, 0)
#define GAC_READ_TILE(k, at, shape, size, ...) GAC(load_tile_##size)(r##k, TILE, a##k + first * (size));
#define GAC_READ_TILE_NUMBER(k, at) GAC_READ_TILE(k, at, 1, 1, 0)
#define GAC_LOAD_TILES(k, at, shape, size, ...) GAC(load_##size)(x##k, (const char *)(r##k + i), &step);
#define GAC_LOAD_TILES_NUMBER(k, at) x##k[0] = r##k[i];
#define GAC_STORE_TILES(k, at, shape, size, ...) GAC(store_##size)((char *)(r##k + i), &step, x##k);
#define GAC_WRITE_TILE(k, at, shape, size, ...) GAC(store_tile_##size)(a##k + first * (size), r##k, TILE);
#define GAC_IN_TILES(name, parts, setup, call)                                      \
    GAC_HEAD_v3(name)                                                               \
    {                                                                               \
        const intptr_t step = TILE * sizeof(REAL);                                  \
        (void)strides;                                                              \
        setup                                                                       \
        parts(GAC_TILES, GAC_TILES_NUMBER, GAC_TILES, )                             \
        for (intptr_t first = 0; first < n; first += TILE) {                        \
            parts(GAC_READ_TILE, GAC_READ_TILE_NUMBER, GAC_NONE, )                  \
            ANY_ORDER                                                               \
            for (intptr_t i = 0; i < TILE; ++i) {                                   \
                GAC_ELEMENT(parts, TILES, call)                                     \
            }                                                                       \
            parts(GAC_NONE, GAC_NONE, GAC_WRITE_TILE, )                             \
        }                                                                           \
    }                                                                               \
    LOOP(name)

/* Loops in C order in which the compiler transposes elements as it reads them; results are copied through rows of a few
   elements. Results of neighbouring components are never written next to each other: compilers that combine sums and
   differences of an element into one vector may fuse them with products even if contraction is off (gcc 12 does). */
#define GAC_DIRECT(k, at, shape, size, ...) REAL *const a##k = (REAL *)args[k];
#define GAC_DIRECT_NUMBER(k, at) REAL *const a##k = (REAL *)args[k];
#define GAC_DIRECT_ROWS(k, at, shape, size, ...)                                    \
    REAL *const a##k = (REAL *)args[k];                                             \
    _Alignas(64) REAL r##k[(size) * LANES];
#define GAC_LOAD_DIRECT(k, at, shape, size, ...) GAC(load_##size)(x##k, (char *)a##k + (first + i) * (size) * w, &w);
#define GAC_LOAD_DIRECT_NUMBER(k, at) x##k[0] = a##k[first + i];
#define GAC_STORE_DIRECT(k, at, shape, size, ...) GAC(store_##size)((char *)(r##k + i), &step, x##k);
#define GAC_WRITE_ROWS(k, at, shape, size, ...) GAC(store_few)(a##k + first * (size), r##k, size, LANES, LANES);
#define GAC_IN_ORDER(name, parts, setup, call)                                      \
    GAC_HEAD(name)                                                                  \
    {                                                                               \
        const intptr_t w = sizeof(REAL), step = LANES * w;                          \
        (void)strides;                                                              \
        setup                                                                       \
        parts(GAC_DIRECT, GAC_DIRECT_NUMBER, GAC_DIRECT_ROWS, )                     \
        for (intptr_t first = 0; first < n; first += LANES) {                       \
            ANY_ORDER                                                               \
            for (intptr_t i = 0; i < LANES; ++i) {                                  \
                GAC_ELEMENT(parts, DIRECT, call)                                    \
            }                                                                       \
            parts(GAC_NONE, GAC_NONE, GAC_WRITE_ROWS, )                             \
        }                                                                           \
    }                                                                               \
    LOOPS(name)

/* The loops of a kind: of PLAIN functions, BUSY functions (with transcendental functions) and functions with sines or
   cosines (TURNS). In C order there are none (NO), direct loops, or loops in tiles. */
#define GAC_BLOCK_PLAIN(f) GAC_BLOCK(f##_block, PARTS_##f, , NAME(f)(GAC_PASS(PARTS_##f)))
#define GAC_BLOCK_BUSY(f) GAC_BLOCK(f##_block, PARTS_##f, , NAME(f##_within)(GAC_PASS(PARTS_##f)))
#define GAC_BLOCK_TURNS(f)                                                                                      \
    GAC_BLOCK_TWICE(f##_block, PARTS_##f, , NAME(f##_within)(GAC_PASS(PARTS_##f), &far), NAME(f)(GAC_PASS(PARTS_##f)))
#define GAC_DENSE_NO(f)
#define GAC_DENSE_DIRECT(f) GAC_IN_ORDER(f##_dense, PARTS_##f, , NAME(f)(GAC_PASS(PARTS_##f)))
#define GAC_DENSE_TILES(f) GAC_IN_TILES(f##_dense, PARTS_##f, , NAME(f)(GAC_PASS(PARTS_##f)))

#define GAC_FORM_PLAIN(f, m, setup)                                                                             \
    GAC_BLOCK(f##_block_##m, PARTS_##f##_##m, setup, NAME(f##_apply_##m)(prepared, GAC_PASS(PARTS_##f##_##m)))
#define GAC_FORM_TURNS(f, m, setup)                                                                             \
    GAC_BLOCK_TWICE(f##_block_##m, PARTS_##f##_##m, setup,                                                      \
        NAME(f##_apply_##m)(prepared, GAC_PASS(PARTS_##f##_##m), &far),                                         \
        NAME(f##_apply_##m)(prepared, GAC_PASS(PARTS_##f##_##m), NULL))
#define GAC_FORM_NO(f, m, setup)
#define GAC_FORM_DIRECT(f, m, setup)                                                                            \
    GAC_IN_ORDER(f##_dense_##m, PARTS_##f##_##m, setup, NAME(f##_apply_##m)(prepared, GAC_PASS(PARTS_##f##_##m)))
#define GAC_FORM_TILES(f, m, setup)                                                                             \
    GAC_IN_TILES(f##_dense_##m, PARTS_##f##_##m, setup, NAME(f##_apply_##m)(prepared, GAC_PASS(PARTS_##f##_##m)))

#define GAC_TABLE_NO(name) {NULL, NULL}, 0
#define GAC_TABLE_DIRECT(name) WIDTHS(name), LANES
#define GAC_TABLE_TILES(name) WIDTH(name), TILE

/* The function that prepares a form from the arguments that are the same for the whole batch, the parts in SAME. */
#define GAC_LOAD_ONCE(k, at, shape, size, rank, ...)                                \
    const intptr_t c##k[GAC_MOST_AXES] = GAC_CORES(at, rank);                       \
    GAC(load_##shape)(x##k, args[k], c##k);
#define GAC_LOAD_ONCE_NUMBER(k, at) x##k[0] = *(const REAL *)args[k];
#define GAC_STORE_ONCE(...)
#define GAC_PREPARE_PLAIN(f, m) NAME(f##_prepare_##m)(GAC_PASS(SAME_##f##_##m), prepared)
#define GAC_PREPARE_TURNS(f, m) NAME(f##_prepare_##m)(GAC_PASS(SAME_##f##_##m), prepared, NULL)

/* GAC_FORM(kernel, form, first, preparing, applying, dense): the loops of a form, whose prepared numbers replace the
   argument `first`. */
#define GAC_FORM(f, m, first, preparing, applying, dense)                                                       \
    static void NAME(f##_start_##m)(char **args, const intptr_t *strides, void *prepared)                        \
    {                                                                                                           \
        (void)strides;                                                                                          \
        GAC_ELEMENT(SAME_##f##_##m, ONCE, GAC_PREPARE_##preparing(f, m))                                        \
    }                                                                                                           \
    GAC_FORM_##applying(f, m, GAC_PREPARED(first))                                                              \
    GAC_FORM_##dense(f, m, GAC_PREPARED(first))

/* GAC_USE(kernel, form, dense, same, least, n_prepared): the entry of a form in the table of its kernel. */
#define GAC_USE(f, m, dense, same, least, n_prepared)                                                           \
    {                                                                                                           \
        same, least, n_prepared, NAME(f##_start_##m), WIDTHS(f##_block_##m), GAC_TABLE_##dense(f##_dense_##m)   \
    }

/* GAC_KERNEL(kernel, kind, dense): the loops of a kernel, and the function that runs it over a batch. Forms follow in
   GAC_KERNEL_AND_FORMS. */
#define GAC_PART(k, at, shape, size, rank, ...) {size, rank, at, {__VA_ARGS__}}
#define GAC_PART_NUMBER(k, at) {1, 0, at, {0}}
#define GAC_TYPE(...) const REAL *
#define GAC_TYPE_NUMBER(...) REAL
#define GAC_TYPE_RESULT(...) REAL *
#define GAC_POINTER(k, ...) x[k]
#define GAC_POINTER_NUMBER(k, at) *(const REAL *)x[k]
#define GAC_ONE(...) 1
#define GAC_ZERO(...) 0
#define GAC_SIZE(k, at, shape, size, ...) (size)
#define GAC_RANK(k, at, shape, size, rank, ...) (rank)
#define GAC_IS_BUSY_PLAIN 0
#define GAC_IS_BUSY_BUSY 1
#define GAC_IS_BUSY_TURNS 1
#define GAC_REPEATS_PLAIN 0
#define GAC_REPEATS_BUSY 0
#define GAC_REPEATS_TURNS 1
#define GAC_LOOPS(f, kind, dense)                                                                               \
    GAC_BLOCK_##kind(f)                                                                                         \
    GAC_DENSE_##dense(f)                                                                                        \
    static void NAME(f##_call)(gac_function *function, void **x)                                                \
    {                                                                                                           \
        ((void (*)(PARTS_##f(GAC_TYPE, GAC_TYPE_NUMBER, GAC_TYPE_RESULT, GAC_COMMA)))function)(                 \
            PARTS_##f(GAC_POINTER, GAC_POINTER_NUMBER, GAC_POINTER, GAC_COMMA));                                \
    }
#define GAC_DESCRIBED(f, kind, dense, n_forms, forms)                                                           \
    static const struct gac_part parts[] = {PARTS_##f(GAC_PART, GAC_PART_NUMBER, GAC_PART, GAC_COMMA)};         \
    static const struct gac_kernel kernel = {                                                                   \
        WIDTHS(f##_block), GAC_TABLE_##dense(f##_dense), (gac_function *)NAME(f), NAME(f##_call),               \
        PARTS_##f(GAC_ONE, GAC_ONE, GAC_ZERO, +), PARTS_##f(GAC_ONE, GAC_ONE, GAC_ONE, +),                      \
        PARTS_##f(GAC_RANK, GAC_ZERO, GAC_RANK, +), PARTS_##f(GAC_SIZE, GAC_ONE, GAC_SIZE, +),                  \
        n_forms, GAC_REPEATS_##kind, GAC_IS_BUSY_##kind, parts, forms,                                          \
    };
#define GAC_KERNEL(f, kind, dense)                                                                              \
    GAC_LOOPS(f, kind, dense)                                                                                   \
    void NAME(f##_loop)(char **args, const intptr_t *dimensions, const intptr_t *steps)                         \
    {                                                                                                           \
        GAC_DESCRIBED(f, kind, dense, 0, NULL)                                                                  \
        GAC(batch)(&kernel, args, dimensions[0], steps);                                                        \
    }
#define GAC_KERNEL_AND_FORMS(f, kind, dense, ...)                                                               \
    GAC_LOOPS(f, kind, dense)                                                                                   \
    void NAME(f##_loop)(char **args, const intptr_t *dimensions, const intptr_t *steps)                         \
    {                                                                                                           \
        static const struct gac_form forms[] = {__VA_ARGS__};                                                   \
        GAC_DESCRIBED(f, kind, dense, sizeof forms / sizeof forms[0], forms)                                    \
        GAC(batch)(&kernel, args, dimensions[0], steps);                                                        \
    }

/* Kernels with loops. A table of one element consists of contiguous rows. In the loops over NLANES elements every
   number is replaced by NLANES numbers, one for each element; tables shared by all elements are unchanged. These loops
   call the straight-line parts by the vectorised loops of GAC_IN_LANES(part, kind), which are generated from the list
   of arguments and results,

       #define PARTS_f_2(IN, SAME, NUMBER, OUT, AND) IN(0, 8) AND SAME(1, 6) AND NUMBER(2, 0) AND OUT(3, 8)

   The arguments of each are its index and its number of components. NUMBER is a scalar argument; its second argument is
   1 if all elements share it. */
#define GAC_LANE_ROW(k, size) const REAL *a##k
#define GAC_LANE_RESULT(k, size) REAL *a##k
#define GAC_LANE_VARIABLE(k, size) REAL x##k[size];
#define GAC_LANE_VARIABLE_NUMBER(k, is_same) REAL x##k[1];
#define GAC_LANE_PASSED(k, size) x##k
#define GAC_LANE_PASSED_NUMBER(k, is_same) x##k[0]
#define GAC_LANE_LOAD(k, size) GAC(load_##size)(x##k, (const char *)(a##k + i), &step);
#define GAC_LANE_LOAD_SAME(k, size) GAC(load_##size)(x##k, (const char *)a##k, &w);
#define GAC_LANE_LOAD_NUMBER(k, is_same) x##k[0] = a##k[is_same ? 0 : i];
#define GAC_LANE_STORE(k, size) GAC(store_##size)((char *)(a##k + i), &step, x##k);
#define GAC_LANE_PASS(parts) parts(GAC_LANE_PASSED, GAC_LANE_PASSED, GAC_LANE_PASSED_NUMBER, GAC_LANE_PASSED, GAC_COMMA)
#define GAC_LANES_PLAIN(f) GAC_LANES_OF(f, PARTS_##f, NAME(f)(GAC_LANE_PASS(PARTS_##f)))
#define GAC_LANES_TURNS(f) GAC_LANES_OF(f, PARTS_##f, NAME(f)(GAC_LANE_PASS(PARTS_##f), &far))
#define GAC_IN_LANES(f, kind) GAC_LANES_##kind(f)
#define GAC_LANES_OF(f, parts, call)                                                                                \
    GAC_WIDE_PART WORD NAME(f##_lanes)(parts(GAC_LANE_ROW, GAC_LANE_ROW, GAC_LANE_ROW, GAC_LANE_RESULT, GAC_COMMA)) \
    {                                                                                                               \
        const intptr_t w = sizeof(REAL), step = NLANES * w;                                                          \
        WORD far = 0;                                                                                               \
        (void)w;                                                                                                    \
        ANY_ORDER                                                                                                   \
        for (intptr_t i = 0; i < NLANES; ++i) {                                                                      \
            parts(GAC_LANE_VARIABLE, GAC_LANE_VARIABLE, GAC_LANE_VARIABLE_NUMBER, GAC_LANE_VARIABLE, )              \
            parts(GAC_LANE_LOAD, GAC_LANE_LOAD_SAME, GAC_LANE_LOAD_NUMBER, GAC_NONE, )                              \
            call;                                                                                                   \
            parts(GAC_NONE, GAC_NONE, GAC_NONE, GAC_LANE_STORE, )                                                   \
        }                                                                                                           \
        return far;                                                                                                 \
    }

/* Statements of kernels with loops on `n` numbers; SPREAD and ADD_SPREAD have `n` numbers that are shared by NLANES
   elements. */
#define COPY(n, from, to) GAC(copy)(n, from, to)
#define SPREAD(n, from, to) GAC(spread)(n, from, to)
#define ADD(n, from, to) GAC(add)(n, from, to)
#define ADD_SPREAD(n, from, to) GAC(add_spread)(n, from, to)
#define CLEAR(n, to) GAC(clear)(n, to)

/* Steps that are repeated until a condition holds for all of NLANES elements. While some elements have ended, tables
   that the steps change are copied before a step and copied back for these elements after it. */
#define ROUNDS(name, limit) for (struct GAC(rounds) name = {0}; name.count < (limit); ++name.count)
#define KEEP(rounds, n, from, to) if (rounds.some) COPY(n, from, to)
#define RESTORE(rounds, n, from, to) if (rounds.some) GAC(restore)(rounds.ended, n, from, to)
#define COUNT(rounds, steps) GAC(count)(rounds.ended, steps)
#define ALL_ENDED(rounds, until) GAC(all_ended)(&rounds, until)

/* GAC_PROCEDURE(kernel, kind): the function that runs a kernel with loops over a batch, by its loops over NLANES
   elements or ALONE; BUSY kernels compute transcendental functions. It is generated from the lists of lengths and
   tables,

       #define TABLES_f(LENGTH, IN, NUMBER, SAME, INDEX, OUT, AND)
           LENGTH(0, n) AND IN(0, q, scalar, 1, n) AND INDEX(1, parents, n, n) AND OUT(2, out, 2x4, 8, n)
       #define WORK_f(WORK) WORK(3, sums, 8, 8, n)

   The arguments of each are its index, its name, the shape of its rows, the size of a row and the number of rows; an
   index table has its number of rows and the length that it refers to. A single element calls the plain function
   directly if its work space is at most GAC_NEAR numbers. */
#define GAC_NEAR 1024
#define GAC_LENGTH(k, name) const intptr_t name = gac_lengths[k];
#define GAC_LENGTH_UNUSED(k, name) (void)name;
#define GAC_LENGTH_PASSED(k, name) gac_lengths[k]
#define GAC_ARRAY_PASSED(k, ...) (const REAL *)gac_args[k]
#define GAC_VALUE_PASSED(k, ...) *(const REAL *)gac_args[k]
#define GAC_INDEX_PASSED(k, ...) (const int64_t *)gac_args[k]
#define GAC_OUT_PASSED(k, ...) (REAL *)gac_args[k]
#define GAC_WORK_PASSED(k, ...) , (REAL *)gac_args[k]
#define GAC_TABLE_IN(k, name, shape, size, rows) {GAC_IS_IN, (size) * (rows)},
#define GAC_TABLE_NUMBER(k, name) {GAC_IS_IN, 1},
#define GAC_TABLE_SAME(k, name, shape, size, rows) {GAC_IS_SAME, (size) * (rows)},
#define GAC_TABLE_INDEX(k, name, rows, into) {GAC_IS_INDEX, rows},
#define GAC_TABLE_OUT(k, name, shape, size, rows) {GAC_IS_OUT, (size) * (rows)},
#define GAC_TABLE_WORK(k, name, shape, size, rows) {GAC_IS_WORK, (size) * (rows)},
#define GAC_WORK_SIZE(k, name, shape, size, rows) + (size) * (rows)
#define GAC_ONE_MORE(...) + 1
#define GAC_COUNTED(list) list(GAC_NONE, GAC_ONE_MORE, GAC_ONE_MORE, GAC_ONE_MORE, GAC_ONE_MORE, GAC_ONE_MORE, )
#define GAC_PROCEDURE_ALONE(f)
#define GAC_PROCEDURE_LANES(f)                                                                                      \
    GAC_WIDE_LOOP void NAME(f##_tables)(intptr_t gac_last, char **gac_args, const intptr_t *gac_lengths)            \
    {                                                                                                               \
        *(WORD *)gac_args[gac_last] = NAME(f##_lanes)(TABLES_##f(GAC_LENGTH_PASSED, GAC_ARRAY_PASSED,               \
            GAC_ARRAY_PASSED, GAC_ARRAY_PASSED, GAC_INDEX_PASSED, GAC_OUT_PASSED, GAC_COMMA)                        \
            WORK_##f(GAC_WORK_PASSED));                                                                             \
    }                                                                                                               \
    LOOPS(f##_tables)
#define GAC_LOOPS_ALONE(f) {NULL}
#define GAC_LOOPS_LANES(f) WIDTHS(f##_tables)
#define GAC_PROCEDURE_BUSY(f) GAC_PROCEDURE_LANES(f)
#define GAC_LOOPS_BUSY(f) GAC_LOOPS_LANES(f)
#define GAC_IS_BUSY_ALONE 0
#define GAC_IS_BUSY_LANES 0
#define GAC_PROCEDURE(f, kind)                                                                                      \
    GAC_PROCEDURE_##kind(f)                                                                                         \
    static void NAME(f##_call)(const intptr_t *gac_lengths, char **gac_args)                                        \
    {                                                                                                               \
        enum { n_args = GAC_COUNTED(TABLES_##f) };                                                                  \
        NAME(f)(TABLES_##f(GAC_LENGTH_PASSED, GAC_ARRAY_PASSED, GAC_VALUE_PASSED, GAC_ARRAY_PASSED, GAC_INDEX_PASSED, \
            GAC_OUT_PASSED, GAC_COMMA), (REAL *)gac_args[n_args]);                                                  \
    }                                                                                                               \
    int NAME(f##_rows)(const intptr_t *gac_lengths, char **gac_args, const intptr_t *gac_steps, intptr_t gac_n)     \
    {                                                                                                               \
        TABLES_##f(GAC_LENGTH, GAC_NONE, GAC_NONE, GAC_NONE, GAC_NONE, GAC_NONE, )                                  \
        TABLES_##f(GAC_LENGTH_UNUSED, GAC_NONE, GAC_NONE, GAC_NONE, GAC_NONE, GAC_NONE, )                           \
        if (gac_n == 1 && (0 WORK_##f(GAC_WORK_SIZE)) <= GAC_NEAR) {                                                \
            REAL gac_near[GAC_NEAR];                                                                                \
            NAME(f)(TABLES_##f(GAC_LENGTH_PASSED, GAC_ARRAY_PASSED, GAC_VALUE_PASSED, GAC_ARRAY_PASSED,             \
                GAC_INDEX_PASSED, GAC_OUT_PASSED, GAC_COMMA), gac_near);                                            \
            return 0;                                                                                               \
        }                                                                                                           \
        const struct gac_table gac_tables[] = {TABLES_##f(GAC_NONE, GAC_TABLE_IN, GAC_TABLE_NUMBER, GAC_TABLE_SAME, \
            GAC_TABLE_INDEX, GAC_TABLE_OUT, ) WORK_##f(GAC_TABLE_WORK)};                                            \
        static const struct gac_procedure gac_procedure = {NAME(f##_call), GAC_LOOPS_##kind(f),                    \
            GAC_COUNTED(TABLES_##f), GAC_COUNTED(TABLES_##f) WORK_##f(GAC_ONE_MORE), GAC_IS_BUSY_##kind};           \
        return GAC(rows)(&gac_procedure, gac_tables, gac_lengths, gac_args, gac_steps, gac_n);                      \
    }

/* Without functions of batches. */
#ifdef GAC_ONLY_ELEMENTS
#undef GAC_FORM
#undef GAC_KERNEL
#undef GAC_KERNEL_AND_FORMS
#undef GAC_PROCEDURE
#define GAC_FORM(...)
#define GAC_KERNEL(...)
#define GAC_KERNEL_AND_FORMS(...)
#define GAC_PROCEDURE(...)
#endif

/* GAC_TILE(n): copy a tile of TILE elements of `n` numbers from C order to rows and back, for `n` up to
   GAC_TILE_NUMBERS. Most vectors are read in halves, the lower from the first half of the elements and the upper from
   the corresponding place in the second half. Then both halves need the same permutation, which does not cross halves
   and is fastest on processors. Four neighbours in double precision fill a vector and are read as one. The code has
   statements for every size; the compiler removes those whose constant conditions are false. */
#define GAC_TILE_NUMBERS 32
#define GAC_TILE(length) GAC_TILE_FUNCTIONS(REAL, length)
#ifdef SHUFFLE
#define GAC_TILE_FUNCTIONS(real, length) GAC_TILE_OF(real, length)
#define GAC_TILE_OF(real, length)                                                       \
    GAC_HELPER void GAC(load_tile_##length)(REAL *x, intptr_t row, REAL *a)              \
    {                                                                                   \
        enum { size = length };                                                         \
        GAC_LOAD_TILE_##real                                                            \
    }                                                                                   \
    GAC_HELPER void GAC(store_tile_##length)(REAL *a, REAL *x, intptr_t row)             \
    {                                                                                   \
        enum { size = length };                                                         \
        GAC_STORE_TILE_##real                                                           \
    }
#define COLUMN(k) (*(GAC(tile) *)(x + (k) * row))
#define HALF(a, k) (((GAC(half) *)(a))[k])
#define WHOLE(offset) (*(GAC(tile) *)(a + (offset)))
#define UPPER(offset) (a + (offset) + TILE / 2 * size)
#define JOINED(v, w) PRECISION(SHUFFLE(v, w, 0, 1, 2, 3), SHUFFLE(v, w, 0, 1, 2, 3, 4, 5, 6, 7))
#define LOWERS(v, w) PRECISION(SHUFFLE(v, w, 0, 1, 4, 5), SHUFFLE(v, w, 0, 1, 2, 3, 8, 9, 10, 11))
#define UPPERS(v, w) PRECISION(SHUFFLE(v, w, 2, 3, 6, 7), SHUFFLE(v, w, 4, 5, 6, 7, 12, 13, 14, 15))
#define READ(offset) JOINED(HALF(a + (offset), 0), HALF(UPPER(offset), 0))
#define WRITE(offset, v) HALF(a + (offset), 0) = HALF(&v, 0), HALF(UPPER(offset), 0) = HALF(&v, 1)
#define WRITE_BOTH(offset, v, w) WHOLE(offset) = LOWERS(v, w), WHOLE((offset) + TILE / 2 * size) = UPPERS(v, w)

/* A vector in which each half has the given entries of the concatenated halves of two other vectors. */
#define DOUBLES(v, w, i, j) SHUFFLE(v, w, i, 4 + (j), 2 + (i), 6 + (j))
#define FLOATS(v, w, i, j, k, l) \
    SHUFFLE(v, w, FAR(i), FAR(j), FAR(k), FAR(l), 4 + FAR(i), 4 + FAR(j), 4 + FAR(k), 4 + FAR(l))
#define FAR(place) ((place) < 4 ? (place) : (place) + 4)

/* Doubles: four numbers of four elements are permuted at once; one or two remaining numbers are read in halves. */
#define GAC_LOAD_TILE_double                                                                                    \
    if (size == 1) {                                                                                            \
        COLUMN(0) = WHOLE(0);                                                                                   \
    } else if (size == 2) {                                                                                     \
        const GAC(tile) a0 = READ(0), a1 = READ(2);                                                             \
        COLUMN(0) = DOUBLES(a0, a1, 0, 0);                                                                      \
        COLUMN(1) = DOUBLES(a0, a1, 1, 1);                                                                      \
    } else if (size == 3) {                                                                                     \
        const GAC(tile) a0 = READ(0), a1 = READ(2);                                                             \
        COLUMN(0) = DOUBLES(a0, a1, 0, 1);                                                                      \
        const GAC(tile) a2 = READ(4);                                                                           \
        COLUMN(1) = DOUBLES(a0, a2, 1, 0);                                                                      \
        COLUMN(2) = DOUBLES(a1, a2, 0, 1);                                                                      \
    } else {                                                                                                    \
        GAC_TIMES_8(GAC_LOAD_DOUBLES, 0, )                                                                      \
    }
#define GAC_LOAD_DOUBLES(block, ...)                                                                            \
    if (4 * (block) + 3 <= size) {                                                                              \
        enum { done = 4 * (block), first = done + 4 <= size ? done : size - 4 };                                \
        const GAC(tile) a0 = WHOLE(first), a1 = WHOLE(size + first);                                            \
        const GAC(tile) b0 = DOUBLES(a0, a1, 0, 0), b1 = DOUBLES(a0, a1, 1, 1);                                 \
        const GAC(tile) a2 = WHOLE(2 * size + first), a3 = WHOLE(3 * size + first);                             \
        const GAC(tile) b2 = DOUBLES(a2, a3, 0, 0), b3 = DOUBLES(a2, a3, 1, 1);                                 \
        if (first == done)                                                                                      \
            COLUMN(first) = SHUFFLE(b0, b2, 0, 1, 4, 5);                                                        \
        COLUMN(first + 1) = SHUFFLE(b1, b3, 0, 1, 4, 5);                                                        \
        COLUMN(first + 2) = SHUFFLE(b0, b2, 2, 3, 6, 7);                                                        \
        COLUMN(first + 3) = SHUFFLE(b1, b3, 2, 3, 6, 7);                                                        \
    } else if (4 * (block) < size) {                                                                            \
        const GAC(tile) a0 = READ(size - 2), a1 = READ(2 * size - 2);                                           \
        if (4 * (block) + 2 == size)                                                                            \
            COLUMN(size - 2) = DOUBLES(a0, a1, 0, 0);                                                           \
        COLUMN(size - 1) = DOUBLES(a0, a1, 1, 1);                                                               \
    }

/* Two elements consist of `size` halves; two halves that are adjacent in memory are written as one vector. */
#define GAC_STORE_TILE_double                                                                                   \
    if (size == 1) {                                                                                            \
        WHOLE(0) = COLUMN(0);                                                                                   \
    } else {                                                                                                    \
        GAC_TIMES_16(GAC_STORE_DOUBLES, 0, )                                                                    \
    }
#define GAC_HALVES(k) \
    DOUBLES(COLUMN(2 * (k) % size), COLUMN((2 * (k) + 1) % size), 2 * (k) / size & 1, (2 * (k) + 1) / size & 1)
#define GAC_STORE_DOUBLES(pair, ...)                                                                            \
    if (2 * (pair) < size) {                                                                                    \
        const GAC(tile) v = GAC_HALVES(2 * (pair));                                                             \
        if (2 * (pair) + 1 < size) {                                                                            \
            const GAC(tile) w = GAC_HALVES(2 * (pair) + 1);                                                     \
            WRITE_BOTH(4 * (pair), v, w);                                                                       \
        } else {                                                                                                \
            WRITE(4 * (pair), v);                                                                               \
        }                                                                                                       \
    }

/* Floats: four elements consist of `size` halves. Four numbers of each are permuted at once; the last four may overlap
   with the four before. */
#define GAC_LOAD_TILE_float                                                                                     \
    if (size == 1) {                                                                                            \
        COLUMN(0) = WHOLE(0);                                                                                   \
    } else if (size == 2) {                                                                                     \
        const GAC(tile) a0 = READ(0), a1 = READ(4);                                                             \
        COLUMN(0) = FLOATS(a0, a1, 0, 2, 4, 6);                                                                 \
        COLUMN(1) = FLOATS(a0, a1, 1, 3, 5, 7);                                                                 \
    } else if (size == 3) {                                                                                     \
        const GAC(tile) a1 = READ(4), a2 = READ(8), b0 = FLOATS(a1, a2, 2, 3, 5, 6);                            \
        const GAC(tile) a0 = READ(0), b1 = FLOATS(a0, a1, 1, 2, 4, 5);                                          \
        COLUMN(0) = FLOATS(a0, b0, 0, 3, 4, 6);                                                                 \
        COLUMN(1) = FLOATS(b1, b0, 0, 2, 5, 7);                                                                 \
        COLUMN(2) = FLOATS(b1, a2, 1, 3, 4, 7);                                                                 \
    } else {                                                                                                    \
        GAC_TIMES_8(GAC_LOAD_FLOATS, 0, )                                                                       \
    }
#define GAC_LOAD_FLOATS(block, ...)                                                                             \
    if (4 * (block) < size) {                                                                                   \
        enum { done = 4 * (block), first = done + 4 <= size ? done : size - 4 };                                \
        const GAC(tile) a0 = READ(first), a1 = READ(size + first), b0 = FLOATS(a0, a1, 0, 4, 1, 5);             \
        const GAC(tile) a2 = READ(2 * size + first), a3 = READ(3 * size + first), b1 = FLOATS(a2, a3, 0, 4, 1, 5); \
        const GAC(tile) b2 = FLOATS(a0, a1, 2, 6, 3, 7), b3 = FLOATS(a2, a3, 2, 6, 3, 7);                       \
        if (first == done)                                                                                      \
            COLUMN(first) = FLOATS(b0, b1, 0, 1, 4, 5);                                                         \
        if (first + 1 >= done)                                                                                  \
            COLUMN(first + 1) = FLOATS(b0, b1, 2, 3, 6, 7);                                                     \
        if (first + 2 >= done)                                                                                  \
            COLUMN(first + 2) = FLOATS(b2, b3, 0, 1, 4, 5);                                                     \
        COLUMN(first + 3) = FLOATS(b2, b3, 2, 3, 6, 7);                                                         \
    }

/* The halves of an element are written in order, two as one vector if they are adjacent in memory; the last half of an
   element is kept in `kept` until the first half of the next. */
#define GAC_STORE_TILE_float                                                                                    \
    if (size == 1) {                                                                                            \
        WHOLE(0) = COLUMN(0);                                                                                   \
    } else if (size == 2) {                                                                                     \
        const GAC(tile) a0 = FLOATS(COLUMN(0), COLUMN(1), 0, 4, 1, 5), a1 = FLOATS(COLUMN(0), COLUMN(1), 2, 6, 3, 7); \
        WRITE_BOTH(0, a0, a1);                                                                                  \
    } else if (size == 3) {                                                                                     \
        const GAC(tile) b0 = FLOATS(COLUMN(0), COLUMN(1), 0, 2, 4, 6), b2 = FLOATS(COLUMN(2), COLUMN(0), 0, 2, 5, 7); \
        const GAC(tile) b1 = FLOATS(COLUMN(1), COLUMN(2), 1, 3, 5, 7);                                          \
        const GAC(tile) a0 = FLOATS(b0, b2, 0, 2, 4, 6), a1 = FLOATS(b1, b0, 0, 2, 5, 7);                       \
        WRITE_BOTH(0, a0, a1);                                                                                  \
        const GAC(tile) a2 = FLOATS(b2, b1, 1, 3, 5, 7);                                                        \
        WRITE(8, a2);                                                                                           \
    } else {                                                                                                    \
        enum { n_halves = (size + 3) / 4, is_whole = size % 4 == 0, last = is_whole ? n_halves : n_halves - 1 };  \
        GAC(tile) b0[8], b1[8], halves[10], kept = {0};                                                         \
        GAC_TIMES_8(GAC_TURN_FLOATS, 0, 0)                                                                      \
        GAC_STORE_ELEMENT(0)                                                                                    \
        GAC_STORE_ELEMENT(1)                                                                                    \
        GAC_TIMES_8(GAC_TURN_FLOATS, 0, 2)                                                                      \
        GAC_STORE_ELEMENT(2)                                                                                    \
        GAC_STORE_ELEMENT(3)                                                                                    \
        if (!is_whole)                                                                                          \
            WRITE(4 * size - 4, kept);                                                                          \
    }
#define GAC_TURN_FLOATS(block, place)                                                                           \
    if (4 * (block) < size) {                                                                                   \
        enum { first = 4 * (block) + 4 <= size ? 4 * (block) : size - 4 };                                      \
        b0[block] = FLOATS(COLUMN(first), COLUMN(first + 1), place, 4 + place, 1 + place, 5 + place);           \
        b1[block] = FLOATS(COLUMN(first + 2), COLUMN(first + 3), place, 4 + place, 1 + place, 5 + place);       \
    }
#define GAC_STORE_ELEMENT(k)                                                                                    \
    {                                                                                                           \
        enum { element = k, has_kept = is_whole ? element * n_halves % 2 : element > 0 };                       \
        GAC_TIMES_8(GAC_TAKE_HALF, 0, element % 2 * 2)                                                          \
        if (has_kept)                                                                                           \
            WRITE_BOTH(element * size - 4, kept, halves[0]);                                                    \
        GAC_TIMES_4(GAC_STORE_HALVES, 0, )                                                                      \
        if (!is_whole)                                                                                          \
            kept = halves[n_halves - 1];                                                                        \
    }
#define GAC_TAKE_HALF(block, place)                                                                             \
    if (4 * (block) < size)                                                                                     \
        halves[block] = FLOATS(b0[block], b1[block], place, 1 + place, 4 + place, 5 + place);
#define GAC_STORE_HALVES(pair, ...)                                                                             \
    {                                                                                                           \
        enum { h = has_kept + 2 * (pair), is_last = h + 1 == (int)last, are_two = h + 1 < (int)last };            \
        if (are_two)                                                                                             \
            WRITE_BOTH(element * size + 4 * h, halves[h], halves[h + 1]);                                       \
        else if (is_last && is_whole)                                                                           \
            kept = halves[h];                                                                                   \
        else if (is_last)                                                                                       \
            WRITE(element * size + 4 * h, halves[h]);                                                           \
    }
#else
#define GAC_TILE_FUNCTIONS(real, length)                                                \
    GAC_HELPER void GAC(load_tile_##length)(REAL *x, intptr_t row, const REAL *a)        \
    {                                                                                   \
        for (intptr_t k = 0; k < length; ++k)                                           \
            for (intptr_t i = 0; i < TILE; ++i)                                         \
                x[k * row + i] = a[i * length + k];                                     \
    }                                                                                   \
    GAC_HELPER void GAC(store_tile_##length)(REAL *a, const REAL *x, intptr_t row)       \
    {                                                                                   \
        for (intptr_t k = 0; k < length; ++k)                                           \
            for (intptr_t i = 0; i < TILE; ++i)                                         \
                a[i * length + k] = x[k * row + i];                                     \
    }
#endif

/* Both precisions. */
#define REAL double
#define PRECISION(of_double, of_float) of_double
#include "gac_runtime.h"
#undef REAL
#undef PRECISION
#define REAL float
#define PRECISION(of_double, of_float) of_float
#include "gac_runtime.h"
#undef REAL
#undef PRECISION

#endif
#else

/* For each precision. */

#ifdef SHUFFLE
typedef REAL GAC(four) VECTOR(4);
typedef REAL GAC(tile) VECTOR(TILE);
typedef REAL GAC(half) VECTOR(TILE / 2);
#endif

static INLINE WORD GAC(bits_of)(REAL x)
{
    WORD bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static INLINE REAL GAC(of_bits)(WORD bits)
{
    REAL x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static INLINE REAL GAC(select)(WORD where, REAL a, REAL b)
{
    return GAC(of_bits)((GAC(bits_of)(a) & where) | (GAC(bits_of)(b) & ~where));
}

/* Both values are computed before one of them is chosen. So loops over kernels are vectorised, and single elements take
   comparisons of floating-point registers instead of masks in integer registers. */
static INLINE REAL GAC(choose)(int condition, REAL a, REAL b)
{
    return condition ? a : b;
}

static INLINE REAL GAC(minimum)(REAL a, REAL b)
{
    const REAL least = a < b ? a : b;
    return a != a ? a : least;
}

static INLINE REAL GAC(maximum)(REAL a, REAL b)
{
    const REAL most = a > b ? a : b;
    return a != a ? a : most;
}

/* Transcendental functions without branches, so that loops over them are vectorised: at most 2 ulp from the exact
   values. */

/* The nearest multiple of pi/2 to an angle, as an integer modulo 4, and the remainder, at most pi/4. The first
   difference is exact, so that rounding occurs only in small remainders. */
static INLINE WORD GAC(quarters_of)(REAL x, REAL *rest)
{
    const REAL shifted = FMA(x, QUARTER_INVERSE, SHIFT), k = SHIFT - shifted;
    *rest = FMA(k, QUARTER_2, FMA(k, QUARTER_1, FMA(k, QUARTER_0, x)));
    return GAC(bits_of)(shifted);
}

static INLINE REAL GAC(sin_of_rest)(REAL x)
{
    const REAL z = x * x;
    return FMA(x * z, GAC(sin_polynomial)(z), x);
}

static INLINE REAL GAC(cos_of_rest)(REAL x)
{
    const REAL z = x * x;
    return FMA(z, FMA(z, GAC(cos_polynomial)(z), (REAL)-0.5), 1);
}

/* Arguments larger than GAC_FARTHEST are passed to the C library; if the caller provides a flag, it is set instead. */
static INLINE REAL GAC(sin)(REAL x, WORD *far)
{
    REAL rest;
    const WORD n = GAC(quarters_of)(FUNCTION(fabs)(x), &rest);
    const WORD is_far = WHERE(FUNCTION(fabs)(x) > GAC_FARTHEST), sign = (GAC(bits_of)(x) ^ n << (SIGN_BIT - 1)) & SIGN;
    const REAL s = GAC(sin_of_rest)(rest), c = GAC(cos_of_rest)(rest);
    const REAL y = GAC(of_bits)(GAC(bits_of)(GAC(select)(WHERE(n & 1), c, s)) ^ sign);
    if (far == NULL)
        return is_far ? FUNCTION(sin)(x) : y;
    *far |= is_far;
    return y;
}

static INLINE REAL GAC(cos)(REAL x, WORD *far)
{
    REAL rest;
    const WORD n = GAC(quarters_of)(FUNCTION(fabs)(x), &rest);
    const WORD is_far = WHERE(FUNCTION(fabs)(x) > GAC_FARTHEST), sign = (n + 1) << (SIGN_BIT - 1) & SIGN;
    const REAL s = GAC(sin_of_rest)(rest), c = GAC(cos_of_rest)(rest);
    const REAL y = GAC(of_bits)(GAC(bits_of)(GAC(select)(WHERE(n & 1), s, c)) ^ sign);
    if (far == NULL)
        return is_far ? FUNCTION(cos)(x) : y;
    *far |= is_far;
    return y;
}

/* The power of 2 is split into two factors, so that the largest and the smallest results are reached. */
static INLINE REAL GAC(exp)(REAL x)
{
    const REAL most = PRECISION(710, 89), least = PRECISION(-746, -105);
    const REAL y = GAC(select)(WHERE(x > most), most, GAC(select)(WHERE(x < least), least, x));
    const REAL shifted = FMA(y, LOG_INVERSE, SHIFT), k = SHIFT - shifted;
    const REAL z = FMA(k, LOG_1, FMA(k, LOG_0, y)), above = FMA(z * z, GAC(exp_polynomial)(z), z);
    const WORD n = GAC(bits_of)(shifted) - GAC(bits_of)(SHIFT), half = ((n + 2 * BIAS) >> 1) - BIAS;
    const REAL a = GAC(of_bits)((half + BIAS) << FRACTION_BITS), b = GAC(of_bits)((n - half + BIAS) << FRACTION_BITS);
    return FMA(above, a, a) * b;
}

static INLINE REAL GAC(log)(REAL x)
{
    /* x = 2^k (1 + f) with 1 + f between the roots of 1/2 and 2; subnormal numbers are scaled first. */
    const WORD tiny = WHERE(x < PRECISION(DBL_MIN, FLT_MIN)), fraction = ((WORD)1 << FRACTION_BITS) - 1;
    const WORD root = PRECISION(0x3FE6A09E667F3BCD, 0x3F3504F3), one = (WORD)BIAS << FRACTION_BITS;
    const REAL y = x * GAC(select)(tiny, (WORD)1 << (FRACTION_BITS + 2), 1);
    const WORD n = GAC(bits_of)(y) + (one - root);
    const REAL shift = (WORD)1 << FRACTION_BITS, bias = GAC(select)(tiny, BIAS + FRACTION_BITS + 2, BIAS);
    const REAL k = GAC(of_bits)((n >> FRACTION_BITS) + GAC(bits_of)(shift)) - (shift + bias);
    const REAL f = GAC(of_bits)((n & fraction) + root) - 1, half = f * f / 2, s = f / (2 + f), z = s * s;
    const REAL low = FMA(s, FMA(z, GAC(log_polynomial)(z), half), k * LOG_1);
    const REAL finite = FMA(k, LOG_0, f - (half - low));
    const REAL other = GAC(select)(WHERE(x == 0), -INFINITY, GAC(select)(WHERE(x > 0), x, NAN));
    return GAC(select)(WHERE(x > 0) & WHERE(x < INFINITY), finite, other);
}

static INLINE REAL GAC(atan2)(REAL y, REAL x)
{
    const REAL u = FUNCTION(fabs)(x), v = FUNCTION(fabs)(y);
    const WORD swapped = WHERE(v > u), left = WHERE(GAC(bits_of)(x) >> SIGN_BIT);
    const REAL most = GAC(select)(swapped, v, u), least = GAC(select)(swapped, u, v);
    /* Two infinities have the ratio 1, two zeros 0. */
    const REAL same = GAC(select)(WHERE(u > 0), 1, 0), t = GAC(select)(WHERE(u == v), same, least / most);
    const REAL z = t * t, angle = FMA(t * z, GAC(atan_polynomial)(z - (REAL)0.5), t);
    const REAL quarters = GAC(select)(swapped, 1, GAC(select)(left, 2, 0));
    const REAL turned = GAC(of_bits)(GAC(bits_of)(angle) ^ ((left ^ swapped) & SIGN));
    const REAL whole = FMA(quarters, QUARTER_0, FMA(quarters, QUARTER_1, turned));
    return GAC(of_bits)(GAC(bits_of)(whole) ^ (GAC(bits_of)(y) & SIGN));
}

static INLINE REAL GAC(acos)(REAL x)
{
    const REAL u = FUNCTION(fabs)(x);
    const WORD large = WHERE(u > (REAL)0.5);
    const REAL z = GAC(select)(large, (1 - u) / 2, x * x), s = GAC(select)(large, FUNCTION(sqrt)(z), x);
    const REAL more = s * (z * GAC(asin_polynomial)(z));
    const REAL middle = QUARTER_0 - (s - (QUARTER_1 - more));
    const REAL right = 2 * (s + more), left = 2 * QUARTER_0 - (right - 2 * QUARTER_1);
    return GAC(select)(large, GAC(select)(WHERE(x < 0), left, right), middle);
}

/* Statements of kernels with loops. */
static INLINE void GAC(copy)(intptr_t n, const REAL *from, REAL *to)
{
    ANY_ORDER
    for (intptr_t i = 0; i < n; ++i)
        to[i] = from[i];
}

static INLINE void GAC(add)(intptr_t n, const REAL *from, REAL *to)
{
    ANY_ORDER
    for (intptr_t i = 0; i < n; ++i)
        to[i] += from[i];
}

static INLINE void GAC(clear)(intptr_t n, REAL *to)
{
    for (intptr_t i = 0; i < n; ++i)
        to[i] = 0;
}

struct GAC(rounds) {
    int count;
    WORD some, ended[NLANES];
};

static INLINE void GAC(restore)(const WORD *ended, intptr_t n, const REAL *from, REAL *to)
{
    for (intptr_t k = 0; k < n; k += NLANES) {
        ANY_ORDER
        for (intptr_t i = 0; i < NLANES; ++i)
            to[k + i] = ended[i] ? from[k + i] : to[k + i];
    }
}

static INLINE void GAC(count)(const WORD *ended, REAL *steps)
{
    for (intptr_t i = 0; i < NLANES; ++i)
        steps[i] += ended[i] ? 0 : 1;
}

static INLINE int GAC(all_ended)(struct GAC(rounds) *rounds, const REAL *until)
{
    WORD all = 1, some = 0;
    for (intptr_t i = 0; i < NLANES; ++i) {
        const WORD is_over = until[i] != 0;
        rounds->ended[i] = is_over;
        all &= is_over;
        some |= is_over;
    }
    rounds->some = some;
    return all != 0;
}

static INLINE void GAC(spread)(intptr_t n, const REAL *from, REAL *to)
{
    for (intptr_t k = 0; k < n; ++k)
        for (intptr_t i = 0; i < NLANES; ++i)
            to[NLANES * k + i] = from[k];
}

static INLINE void GAC(add_spread)(intptr_t n, const REAL *from, REAL *to)
{
    for (intptr_t k = 0; k < n; ++k)
        for (intptr_t i = 0; i < NLANES; ++i)
            to[NLANES * k + i] += from[k];
}

/* A component of a part without axes. */
static INLINE void GAC(load_scalar)(REAL *x, const char *a, const intptr_t *c)
{
    (void)c;
    *x = *(const REAL *)a;
}

static INLINE void GAC(store_scalar)(char *a, const intptr_t *c, const REAL *x)
{
    (void)c;
    *(REAL *)a = *x;
}

/* Copy rows, `row` numbers long, to `n` elements of at most three numbers in C order. */
static INLINE void GAC(store_few)(REAL *a, const REAL *x, intptr_t size, intptr_t row, intptr_t n)
{
    if (size == 1) {
        memcpy(a, x, n * sizeof(REAL));
    } else if (size == 2) {
        for (intptr_t i = 0; i < n; ++i) {
            a[2 * i] = x[i];
            a[2 * i + 1] = x[row + i];
        }
    } else {
        for (intptr_t i = 0; i < n; ++i) {
            a[3 * i] = x[i];
            a[3 * i + 1] = x[row + i];
            a[3 * i + 2] = x[2 * row + i];
        }
    }
}
#endif
