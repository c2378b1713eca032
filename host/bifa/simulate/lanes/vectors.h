// A vector V of LANES numbers and a mask of lanes: for AVX-512, for AVX2, for any other processor with the compiler's
// vector extensions, and for one lane as plain numbers. All processor-specific code is here and in tables.h.
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#define MERGED static inline __attribute__((always_inline))
#define INNER static __attribute__((noinline))

// A number is a double, or a float in single precision (SINGLE). WIDTH: of a vector, in bits.
#ifdef SINGLE
typedef float Number;
typedef int32_t Whole;
#define NUMBER_BITS 32
#define SUFFIXED(name) name##_ps
#else
typedef double Number;
typedef int64_t Whole;
#define NUMBER_BITS 64
#define SUFFIXED(name) name##_pd
#endif
#define WIDTH (LANES * NUMBER_BITS)

#if WIDTH == 512 && defined(__AVX512F__) && defined(__AVX512DQ__)
#define USE_AVX512
#include <immintrin.h>
#define OP(name) SUFFIXED(_mm512_##name)
#ifdef SINGLE
typedef __m512 V;
typedef __mmask16 Mask;
#define COMPARED(a, sign, b, predicate) _mm512_cmp_ps_mask(a, b, predicate)
#else
typedef __m512d V;
typedef __mmask8 Mask;
#define COMPARED(a, sign, b, predicate) _mm512_cmp_pd_mask(a, b, predicate)
#endif
MERGED V splat(Number x) { return OP(set1)(x); }
MERGED Mask and_(Mask a, Mask b) { return (Mask)(a & b); }
MERGED Mask or_(Mask a, Mask b) { return (Mask)(a | b); }
MERGED Mask not_(Mask a) { return (Mask)~a; }
MERGED Mask andnot(Mask a, Mask b) { return (Mask)(~a & b); }
MERGED Mask no_lanes(void) { return 0; }
MERGED Mask all_lanes(void) { return (Mask)-1; }
MERGED Mask lane(int i) { return (Mask)(1 << i); }
MERGED int any(Mask m) { return m != 0; }
MERGED unsigned bits_of(Mask m) { return m; }
MERGED V sel(Mask m, V a, V b) { return OP(mask_blend)(m, b, a); }
MERGED Mask sel_mask(Mask m, Mask a, Mask b) { return (Mask)((m & a) | (~m & b)); }
MERGED V v_sqrt(V x) { return OP(sqrt)(x); }
MERGED V v_fma(V a, V b, V c) { return OP(fmadd)(a, b, c); }
MERGED V v_trunc(V x) { return OP(roundscale)(x, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC); }
MERGED V v_floor(V x) { return OP(roundscale)(x, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC); }
MERGED V v_ceil(V x) { return OP(roundscale)(x, _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC); }
MERGED V v_nearest(V x) { return OP(roundscale)(x, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC); }
MERGED V v_fabs(V x) { return OP(abs)(x); }
MERGED V v_max(V a, V b) { return OP(max)(b, a); } // if either is NaN, the first argument, as in Python
MERGED V v_min(V a, V b) { return OP(min)(b, a); }
MERGED V v_scaled(V x, V power) { return OP(scalef)(x, power); }

#elif WIDTH == 256 && defined(__AVX2__) && defined(__FMA__)
#define USE_AVX2
#include <immintrin.h>
#define OP(name) SUFFIXED(_mm256_##name)
#ifdef SINGLE
typedef __m256 V;
#else
typedef __m256d V;
#endif
typedef V Mask;
typedef Whole Bits __attribute__((vector_size(32)));
MERGED V splat(Number x) { return OP(set1)(x); }
#define COMPARED(a, sign, b, predicate) OP(cmp)(a, b, predicate)
MERGED Mask and_(Mask a, Mask b) { return OP(and)(a, b); }
MERGED Mask or_(Mask a, Mask b) { return OP(or)(a, b); }
MERGED Mask andnot(Mask a, Mask b) { return OP(andnot)(a, b); }
MERGED Mask no_lanes(void) { return OP(setzero)(); }
MERGED Mask all_lanes(void) { return (Mask) ~(Bits){0}; }
MERGED Mask not_(Mask a) { return OP(andnot)(a, all_lanes()); }
MERGED Mask lane(int i) {
    Bits m = {0};
    m[i] = -1;
    return (Mask)m;
}
MERGED int any(Mask m) { return OP(movemask)(m) != 0; }
MERGED unsigned bits_of(Mask m) { return (unsigned)OP(movemask)(m); }
MERGED V sel(Mask m, V a, V b) { return OP(blendv)(b, a, m); }
MERGED Mask sel_mask(Mask m, Mask a, Mask b) { return OP(blendv)(b, a, m); }
MERGED V v_sqrt(V x) { return OP(sqrt)(x); }
MERGED V v_fma(V a, V b, V c) { return OP(fmadd)(a, b, c); }
MERGED V v_trunc(V x) { return OP(round)(x, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC); }
MERGED V v_floor(V x) { return OP(floor)(x); }
MERGED V v_ceil(V x) { return OP(ceil)(x); }
MERGED V v_nearest(V x) { return OP(round)(x, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC); }
MERGED V v_fabs(V x) { return OP(andnot)(OP(set1)(-0.0), x); }
MERGED V v_max(V a, V b) { return OP(max)(b, a); }
MERGED V v_min(V a, V b) { return OP(min)(b, a); }
#define POWER_BY_BITS

#elif LANES == 1
typedef Number V;
typedef int Mask;
typedef Whole Bits;
MERGED V splat(Number x) { return x; }
#define COMPARED(a, sign, b, predicate) (a sign b)
MERGED Mask and_(Mask a, Mask b) { return a & b; }
MERGED Mask or_(Mask a, Mask b) { return a | b; }
MERGED Mask not_(Mask a) { return !a; }
MERGED Mask andnot(Mask a, Mask b) { return !a & b; }
MERGED Mask no_lanes(void) { return 0; }
MERGED Mask all_lanes(void) { return 1; }
MERGED Mask lane(int i) { return i == 0; }
MERGED int any(Mask m) { return m; }
MERGED unsigned bits_of(Mask m) { return (unsigned)m; }
MERGED V sel(Mask m, V a, V b) { return m ? a : b; }
MERGED Mask sel_mask(Mask m, Mask a, Mask b) { return m ? a : b; }
MERGED V v_sqrt(V x) { return sqrt(x); }
MERGED V v_fma(V a, V b, V c) { return a * b + c; }
MERGED V v_trunc(V x) { return trunc(x); }
MERGED V v_floor(V x) { return floor(x); }
MERGED V v_ceil(V x) { return ceil(x); }
MERGED V v_nearest(V x) { return nearbyint(x); }
MERGED V v_fabs(V x) { return fabs(x); }
MERGED V v_max(V a, V b) { return b > a ? b : a; }
MERGED V v_min(V a, V b) { return b < a ? b : a; }
#define POWER_BY_BITS

#else // the compiler maps these vectors to the processor's
typedef Number V __attribute__((vector_size(WIDTH / 8)));
typedef Whole Mask __attribute__((vector_size(WIDTH / 8)));
typedef Mask Bits;
MERGED V splat(Number x) { return x - (V){0}; }
#define COMPARED(a, sign, b, predicate) (a sign b)
MERGED Mask and_(Mask a, Mask b) { return a & b; }
MERGED Mask or_(Mask a, Mask b) { return a | b; }
MERGED Mask not_(Mask a) { return ~a; }
MERGED Mask andnot(Mask a, Mask b) { return ~a & b; }
MERGED Mask no_lanes(void) { return (Mask){0}; }
MERGED Mask all_lanes(void) { return ~(Mask){0}; }
MERGED Mask lane(int i) {
    Mask m = {0};
    m[i] = -1;
    return m;
}
MERGED unsigned bits_of(Mask m) {
    unsigned bits = 0;
    for (int i = 0; i < LANES; i++) bits |= (unsigned)(m[i] & 1) << i;
    return bits;
}
MERGED int any(Mask m) { return bits_of(m) != 0; }
MERGED V sel(Mask m, V a, V b) { return (V)(((Mask)a & m) | ((Mask)b & ~m)); }
MERGED Mask sel_mask(Mask m, Mask a, Mask b) { return (a & m) | (b & ~m); }
#define EACH(name, call)                                \
    MERGED V name(V x) {                                \
        for (int i = 0; i < LANES; i++) x[i] = call(x[i]); \
        return x;                                       \
    }
EACH(v_sqrt, sqrt)
EACH(v_trunc, trunc)
EACH(v_floor, floor)
EACH(v_ceil, ceil)
EACH(v_nearest, nearbyint)
MERGED V v_fma(V a, V b, V c) { return a * b + c; }
MERGED V v_fabs(V x) { return (V)((Mask)x & (all_lanes() ^ (Mask)splat((Number)-0.0))); }
MERGED V v_max(V a, V b) { return sel(b > a, b, a); }
MERGED V v_min(V a, V b) { return sel(b < a, b, a); }
#define POWER_BY_BITS
#endif

#define COMPARISON(name, sign, predicate) \
    MERGED Mask name(V a, V b) { return COMPARED(a, sign, b, predicate); }
COMPARISON(lt, <, _CMP_LT_OQ)
COMPARISON(le, <=, _CMP_LE_OQ)
COMPARISON(gt, >, _CMP_GT_OQ)
COMPARISON(ge, >=, _CMP_GE_OQ)
COMPARISON(eq, ==, _CMP_EQ_OQ)
COMPARISON(ne, !=, _CMP_NEQ_UQ)

#if LANES == 1
MERGED double at_lane(V x, int i) { return (void)i, x; }
MERGED void set_lane(V *x, int i, double value) { (void)i, *x = value; }
#else
MERGED double at_lane(V x, int i) { return x[i]; }
MERGED void set_lane(V *x, int i, double value) { (*x)[i] = value; }
#endif
MERGED Mask lanes_if(int truth) { return truth ? all_lanes() : no_lanes(); }
MERGED Mask finite_(V x) { return lt(v_fabs(x), splat(INFINITY)); }
MERGED double max_f(double a, double b) { return b > a ? b : a; }
MERGED double min_f(double a, double b) { return b < a ? b : a; }

#ifdef SINGLE
#define MANTISSA 23
#define BIAS 127
#define LEAST_EXPONENT (-87.0f)
#define MOST_EXPONENT 88.0f
#define LN2_HIGH 0x1.62e4p-1f // with so few digits that its multiples are exact
#define LN2_LOW 0x1.7f7d1cp-20f
#else
#define MANTISSA 52
#define BIAS 1023
#define LEAST_EXPONENT (-708.0)
#define MOST_EXPONENT 709.0
#define LN2_HIGH 0x1.62e42feep-1
#define LN2_LOW 0x1.a39ef35793c76p-33
#endif

#ifdef POWER_BY_BITS
// x 2^power for integer powers whose result is a normal number
MERGED V v_scaled(V x, V power) {
    V shifted = power + splat((Number)(1.5 * ((Whole)1 << MANTISSA)) + BIAS);
    Bits bits;
    memcpy(&bits, &shifted, sizeof bits);
    bits = (Bits)(bits << MANTISSA);
    memcpy(&shifted, &bits, sizeof bits);
    return x * shifted;
}
#endif

// e^x to within one ulp: x is reduced by a multiple of ln 2 to at most 0.347, then a Taylor series by Estrin's scheme.
MERGED V v_exp(V x) {
    const V bounded = v_min(v_max(x, splat(LEAST_EXPONENT)), splat(MOST_EXPONENT));
    const V n = v_nearest(bounded * splat(0x1.71547652b82fep0));
    V r = v_fma(n, splat(-LN2_HIGH), bounded);
    r = v_fma(n, splat(-LN2_LOW), r);
    const V r2 = r * r;
    const V a = v_fma(r, splat(1.0 / 6), splat(0.5));
    const V b = v_fma(r, splat(1.0 / 120), splat(1.0 / 24));
    const V c = v_fma(r, splat(1.0 / 5040), splat(1.0 / 720));
#ifdef SINGLE
    V sum = v_fma(r2, v_fma(r2, c, b), a); // (e^r - 1 - r) / r^2
#else
    const V r4 = r2 * r2;
    const V d = v_fma(r, splat(1.0 / 362880), splat(1.0 / 40320));
    const V e = v_fma(r, splat(1.0 / 39916800), splat(1.0 / 3628800));
    const V f = v_fma(r, splat(1.0 / 6227020800), splat(1.0 / 479001600));
    const V low = v_fma(r2, b, a), high = v_fma(r2, d, c), top = v_fma(r2, f, e);
    V sum = v_fma(r4, v_fma(r4, top, high), low); // (e^r - 1 - r) / r^2
#endif
    sum = v_fma(r2, sum, r) + splat(1.0);
    V grown = v_scaled(sum, n);
    grown = sel(lt(x, splat(LEAST_EXPONENT)), splat(0.0), grown);
    grown = sel(gt(x, splat(MOST_EXPONENT)), splat(INFINITY), grown);
    return sel(ne(x, x), x, grown);
}

// These functions are rarely used: glibc's vector versions where available, otherwise one lane at a time.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(USE_AVX512) && !defined(SINGLE)
#define FROM_GLIBC(name) _ZGVeN8v_##name
#define FROM_GLIBC_2(name) _ZGVeN8vv_##name
#elif defined(__x86_64__) && defined(__GLIBC__) && defined(USE_AVX512)
#define FROM_GLIBC(name) _ZGVeN16v_##name##f
#define FROM_GLIBC_2(name) _ZGVeN16vv_##name##f
#elif defined(__x86_64__) && defined(__GLIBC__) && defined(USE_AVX2) && !defined(SINGLE)
#define FROM_GLIBC(name) _ZGVdN4v_##name
#define FROM_GLIBC_2(name) _ZGVdN4vv_##name
#elif defined(__x86_64__) && defined(__GLIBC__) && defined(USE_AVX2)
#define FROM_GLIBC(name) _ZGVdN8v_##name##f
#define FROM_GLIBC_2(name) _ZGVdN8vv_##name##f
#endif
#define ONE_BY_ONE(name)                                                      \
    MERGED V v_##name(V x) {                                                  \
        for (int i = 0; i < LANES; i++) set_lane(&x, i, name(at_lane(x, i))); \
        return x;                                                             \
    }
#define ONE_BY_ONE_2(name)                                                                   \
    MERGED V v_##name(V x, V y) {                                                            \
        for (int i = 0; i < LANES; i++) set_lane(&x, i, name(at_lane(x, i), at_lane(y, i))); \
        return x;                                                                            \
    }
#ifdef FROM_GLIBC
V FROM_GLIBC(log)(V);
V FROM_GLIBC(sin)(V);
V FROM_GLIBC(cos)(V);
V FROM_GLIBC_2(pow)(V, V);
MERGED V v_log(V x) { return FROM_GLIBC(log)(x); }
MERGED V v_sin(V x) { return FROM_GLIBC(sin)(x); }
MERGED V v_cos(V x) { return FROM_GLIBC(cos)(x); }
MERGED V v_pow(V x, V y) { return FROM_GLIBC_2(pow)(x, y); }
#else
ONE_BY_ONE(log)
ONE_BY_ONE(sin)
ONE_BY_ONE(cos)
ONE_BY_ONE_2(pow)
#endif
ONE_BY_ONE(tan)
ONE_BY_ONE(tanh)
ONE_BY_ONE(atan)
ONE_BY_ONE_2(atan2)
ONE_BY_ONE_2(hypot)
ONE_BY_ONE_2(copysign)
