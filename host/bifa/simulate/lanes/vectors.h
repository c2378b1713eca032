// A vector V of LANES numbers and a mask of lanes: for AVX-512, for AVX2, for any other processor with the compiler's
// vector extensions, and for one lane as plain numbers. All processor-specific code is here and in tables.h.
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#define MERGED static inline __attribute__((always_inline))
#define INNER static __attribute__((noinline))

#if LANES == 8 && defined(__AVX512F__) && defined(__AVX512DQ__)
#include <immintrin.h>
typedef __m512d V;
typedef __mmask8 Mask;
typedef __m512i Bits;
MERGED V splat(double x) { return _mm512_set1_pd(x); }
#define COMPARED(a, sign, b, predicate) _mm512_cmp_pd_mask(a, b, predicate)
MERGED Mask and_(Mask a, Mask b) { return (Mask)(a & b); }
MERGED Mask or_(Mask a, Mask b) { return (Mask)(a | b); }
MERGED Mask not_(Mask a) { return (Mask)~a; }
MERGED Mask andnot(Mask a, Mask b) { return (Mask)(~a & b); }
MERGED Mask no_lanes(void) { return 0; }
MERGED Mask all_lanes(void) { return 0xFF; }
MERGED Mask lane(int i) { return (Mask)(1 << i); }
MERGED int any(Mask m) { return m != 0; }
MERGED unsigned bits_of(Mask m) { return m; }
MERGED V sel(Mask m, V a, V b) { return _mm512_mask_blend_pd(m, b, a); }
MERGED Mask sel_mask(Mask m, Mask a, Mask b) { return (Mask)((m & a) | (~m & b)); }
MERGED V v_sqrt(V x) { return _mm512_sqrt_pd(x); }
MERGED V v_fma(V a, V b, V c) { return _mm512_fmadd_pd(a, b, c); }
MERGED V v_trunc(V x) { return _mm512_roundscale_pd(x, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC); }
MERGED V v_floor(V x) { return _mm512_roundscale_pd(x, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC); }
MERGED V v_ceil(V x) { return _mm512_roundscale_pd(x, _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC); }
MERGED V v_nearest(V x) { return _mm512_roundscale_pd(x, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC); }
MERGED V v_fabs(V x) { return _mm512_abs_pd(x); }
MERGED V v_max(V a, V b) { return _mm512_max_pd(b, a); } // if either is NaN, the first argument, as in Python
MERGED V v_min(V a, V b) { return _mm512_min_pd(b, a); }
MERGED V v_scaled(V x, V power) { return _mm512_scalef_pd(x, power); }

#elif LANES == 4 && defined(__AVX2__) && defined(__FMA__)
#include <immintrin.h>
typedef __m256d V;
typedef __m256d Mask;
MERGED V splat(double x) { return _mm256_set1_pd(x); }
#define COMPARED(a, sign, b, predicate) _mm256_cmp_pd(a, b, predicate)
MERGED Mask and_(Mask a, Mask b) { return _mm256_and_pd(a, b); }
MERGED Mask or_(Mask a, Mask b) { return _mm256_or_pd(a, b); }
MERGED Mask andnot(Mask a, Mask b) { return _mm256_andnot_pd(a, b); }
MERGED Mask no_lanes(void) { return _mm256_setzero_pd(); }
MERGED Mask all_lanes(void) { return _mm256_castsi256_pd(_mm256_set1_epi64x(-1)); }
MERGED Mask not_(Mask a) { return _mm256_andnot_pd(a, all_lanes()); }
MERGED Mask lane(int i) {
    return _mm256_castsi256_pd(_mm256_cmpeq_epi64(_mm256_set_epi64x(3, 2, 1, 0), _mm256_set1_epi64x(i)));
}
MERGED int any(Mask m) { return _mm256_movemask_pd(m) != 0; }
MERGED unsigned bits_of(Mask m) { return (unsigned)_mm256_movemask_pd(m); }
MERGED V sel(Mask m, V a, V b) { return _mm256_blendv_pd(b, a, m); }
MERGED Mask sel_mask(Mask m, Mask a, Mask b) { return _mm256_blendv_pd(b, a, m); }
MERGED V v_sqrt(V x) { return _mm256_sqrt_pd(x); }
MERGED V v_fma(V a, V b, V c) { return _mm256_fmadd_pd(a, b, c); }
MERGED V v_trunc(V x) { return _mm256_round_pd(x, _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC); }
MERGED V v_floor(V x) { return _mm256_floor_pd(x); }
MERGED V v_ceil(V x) { return _mm256_ceil_pd(x); }
MERGED V v_nearest(V x) { return _mm256_round_pd(x, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC); }
MERGED V v_fabs(V x) { return _mm256_andnot_pd(_mm256_set1_pd(-0.0), x); }
MERGED V v_max(V a, V b) { return _mm256_max_pd(b, a); }
MERGED V v_min(V a, V b) { return _mm256_min_pd(b, a); }
#define POWER_BY_BITS
typedef int64_t Bits __attribute__((vector_size(32)));

#elif LANES == 1
typedef double V;
typedef int Mask;
typedef int64_t Bits;
MERGED V splat(double x) { return x; }
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
typedef double V __attribute__((vector_size(8 * LANES)));
typedef int64_t Mask __attribute__((vector_size(8 * LANES)));
typedef Mask Bits;
MERGED V splat(double x) { return x - (V){0}; }
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
MERGED V v_fabs(V x) { return (V)((Mask)x & (all_lanes() ^ (Mask)splat(-0.0))); }
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

#ifdef POWER_BY_BITS
// x 2^power for integer powers from -1022 to 1023
MERGED V v_scaled(V x, V power) {
    V shifted = power + splat(0x1.8p52 + 1023.0);
    Bits bits;
    memcpy(&bits, &shifted, sizeof bits);
    bits = (Bits)(bits << 52);
    memcpy(&shifted, &bits, sizeof bits);
    return x * shifted;
}
#endif

// e^x to within one ulp: x is reduced by a multiple of ln 2 to at most 0.347, then a Taylor series by Estrin's scheme.
MERGED V v_exp(V x) {
    const V bounded = v_min(v_max(x, splat(-708.0)), splat(709.0));
    const V n = v_nearest(bounded * splat(0x1.71547652b82fep0));
    V r = v_fma(n, splat(-0x1.62e42feep-1), bounded);
    r = v_fma(n, splat(-0x1.a39ef35793c76p-33), r);
    const V r2 = r * r, r4 = r2 * r2;
    const V a = v_fma(r, splat(1.0 / 6), splat(0.5));
    const V b = v_fma(r, splat(1.0 / 120), splat(1.0 / 24));
    const V c = v_fma(r, splat(1.0 / 5040), splat(1.0 / 720));
    const V d = v_fma(r, splat(1.0 / 362880), splat(1.0 / 40320));
    const V e = v_fma(r, splat(1.0 / 39916800), splat(1.0 / 3628800));
    const V f = v_fma(r, splat(1.0 / 6227020800), splat(1.0 / 479001600));
    const V low = v_fma(r2, b, a), high = v_fma(r2, d, c), top = v_fma(r2, f, e);
    V sum = v_fma(r4, v_fma(r4, top, high), low); // (e^r - 1 - r) / r^2
    sum = v_fma(r2, sum, r) + splat(1.0);
    V grown = v_scaled(sum, n);
    grown = sel(lt(x, splat(-708.0)), splat(0.0), grown);
    grown = sel(gt(x, splat(709.0)), splat(INFINITY), grown);
    return sel(ne(x, x), x, grown);
}

// These functions are rarely used: glibc's vector versions where available, otherwise one lane at a time.
#if defined(__x86_64__) && defined(__GLIBC__) && LANES == 8 && defined(__AVX512F__)
#define FROM_GLIBC(name) _ZGVeN8v_##name
#define FROM_GLIBC_2(name) _ZGVeN8vv_##name
#elif defined(__x86_64__) && defined(__GLIBC__) && LANES == 4 && defined(__AVX2__)
#define FROM_GLIBC(name) _ZGVdN4v_##name
#define FROM_GLIBC_2(name) _ZGVdN4vv_##name
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
