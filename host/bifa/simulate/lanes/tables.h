// The kernel's data structures: Plant, Mounting and Run of bifa.simulate, with a vector of lanes for each number.
// NUMBERS, MEMORY and the constants of the layout are defined above.

typedef struct {
    const double *at;
    long size;
} Series;

// Rows of results, `columns` vectors each.
typedef struct {
    V *at;
    long columns;
} Rows;

// One stiffness table per lane, laid out as in bifa.simulate.tables.
typedef struct {
    const double *rows[LANES];
    V lower, upper, per_width;
    long count;
} Curve;

// Learnt curves of each lane (bifa.simulate.learnt); no terms if nothing was learnt.
typedef struct {
    const double *rows[LANES];
    long terms, columns;
} Learnt;

// A table of bifa.simulate.terrain, the same in all lanes.
typedef struct {
    const double *rows;
    long height, columns;
} Terrain;

typedef struct {
    V q[NUMBERS];
    int64_t active[LANES], any; // bits of effects and learnt curves, for each lane and for all combined
    int same;                   // whether the bits are the same in all lanes
    Curve body_curve, small_curve;
    Learnt learnt;
} Plant;

typedef struct {
    long parts, free, wall;
    double looser;
    V incline_rad, positive_psi, negative_psi, share[3];
    Terrain terrain;
} Mounting;

typedef struct {
    V y[STATES], z[MEMORY], clock[3], slip[1], command[3], gravity[2], source[3];
    V whole[STATES], first[STATES], halves[STATES], z_whole[MEMORY], z_first[MEMORY], z_halves[MEMORY], read[3];
    Mask live;    // lanes with a simulation; the others are idle
    int together; // whether the lanes share their steps
} Run;

MERGED Mask having(const Plant *plant, int64_t bits) {
    if (__builtin_expect(!(plant->any & bits), 1)) return no_lanes();
    if (plant->same) return all_lanes();
    Mask found = no_lanes();
    for (int i = 0; i < LANES; i++)
        if (plant->active[i] & bits) found = or_(found, lane(i));
    return found;
}

typedef struct {
    V r0, r1, r2;
} Three;
typedef struct {
    V r0, r1, r2, r3;
} Four;

// Replacements for functions that could not be translated; never called.
MERGED V nothing(void) { return splat(NAN); }
typedef struct {
    V r0, r1;
} Two;
MERGED Two nothing_twice(void) { return (Two){splat(NAN), splat(NAN)}; }

MERGED Three reach_of(const Curve *curve) { return (Three){curve->lower, curve->upper, curve->per_width}; }

// The four coefficients in each lane's own row.
MERGED Four row_of(const Curve *curve, V row) {
    const V place = v_min(v_max(splat(1.0), row), splat((double)(curve->count - 1)));
#if defined(SINGLE) && defined(OP)
    int at[LANES] __attribute__((aligned(64)));
#define ROW(i) _mm256_cvtpd_ps(_mm256_loadu_pd(curve->rows[i] + at[i]))
#ifdef USE_AVX512
    _mm512_store_si512(at, _mm512_slli_epi32(_mm512_cvttps_epi32(place), 2));
#define PAIR(i, j) _mm512_insertf32x4(_mm512_castps128_ps512(ROW(i)), ROW(j), 1)
#define ROWS(i) _mm512_insertf32x4(_mm512_insertf32x4(PAIR(i, i + 4), ROW(i + 8), 2), ROW(i + 12), 3)
#define TWICE(name, a, b) _mm512_castpd_ps(_mm512_##name##_pd(_mm512_castps_pd(a), _mm512_castps_pd(b)))
#else
    _mm256_store_si256((__m256i *)at, _mm256_slli_epi32(_mm256_cvttps_epi32(place), 2));
#define ROWS(i) _mm256_insertf128_ps(_mm256_castps128_ps256(ROW(i)), ROW(i + 4), 1)
#define TWICE(name, a, b) _mm256_castpd_ps(_mm256_##name##_pd(_mm256_castps_pd(a), _mm256_castps_pd(b)))
#endif
    const V a = ROWS(0), b = ROWS(1), c = ROWS(2), d = ROWS(3);
    const V low_ab = OP(unpacklo)(a, b), high_ab = OP(unpackhi)(a, b);
    const V low_cd = OP(unpacklo)(c, d), high_cd = OP(unpackhi)(c, d);
    return (Four){TWICE(unpacklo, low_ab, low_cd), TWICE(unpackhi, low_ab, low_cd),
                  TWICE(unpacklo, high_ab, high_cd), TWICE(unpackhi, high_ab, high_cd)};
#elif defined(USE_AVX512)
    int64_t at[8] __attribute__((aligned(64)));
    _mm512_store_si512(at, _mm512_slli_epi64(_mm512_cvttpd_epi64(place), 2));
#define PAIR(i, j)                                                                         \
    _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(curve->rows[i] + at[i])),    \
                       _mm256_loadu_pd(curve->rows[j] + at[j]), 1)
    const V a = PAIR(0, 4), b = PAIR(1, 5), c = PAIR(2, 6), d = PAIR(3, 7);
#undef PAIR
    const V even_ab = _mm512_unpacklo_pd(a, b), odd_ab = _mm512_unpackhi_pd(a, b);
    const V even_cd = _mm512_unpacklo_pd(c, d), odd_cd = _mm512_unpackhi_pd(c, d);
    const __m512i low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13), high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
    return (Four){_mm512_permutex2var_pd(even_ab, low, even_cd), _mm512_permutex2var_pd(odd_ab, low, odd_cd),
                  _mm512_permutex2var_pd(even_ab, high, even_cd), _mm512_permutex2var_pd(odd_ab, high, odd_cd)};
#elif defined(USE_AVX2)
    int at[4] __attribute__((aligned(16)));
    _mm_store_si128((__m128i *)at, _mm_slli_epi32(_mm256_cvttpd_epi32(place), 2));
#define ROW(i) _mm256_loadu_pd(curve->rows[i] + at[i])
    const V a = ROW(0), b = ROW(1), c = ROW(2), d = ROW(3);
#undef ROW
    const V even_ab = _mm256_unpacklo_pd(a, b), odd_ab = _mm256_unpackhi_pd(a, b);
    const V even_cd = _mm256_unpacklo_pd(c, d), odd_cd = _mm256_unpackhi_pd(c, d);
    return (Four){_mm256_permute2f128_pd(even_ab, even_cd, 0x20), _mm256_permute2f128_pd(odd_ab, odd_cd, 0x20),
                  _mm256_permute2f128_pd(even_ab, even_cd, 0x31), _mm256_permute2f128_pd(odd_ab, odd_cd, 0x31)};
#else
    Four found = {splat(0.0), splat(0.0), splat(0.0), splat(0.0)};
    for (int i = 0; i < LANES; i++) {
        const double *entry = curve->rows[i] + 4 * (long)at_lane(place, i);
        set_lane(&found.r0, i, entry[0]);
        set_lane(&found.r1, i, entry[1]);
        set_lane(&found.r2, i, entry[2]);
        set_lane(&found.r3, i, entry[3]);
    }
    return found;
#endif
}

MERGED V learnt_entry(const Learnt *table, V row, V column) {
    const V term = v_min(v_max(splat(0.0), row), splat((double)(table->terms - 1)));
    const V place = v_min(v_max(splat(0.0), column), splat((double)(table->columns - 1)));
#if defined(USE_AVX512) && !defined(SINGLE)
    const __m512i at = _mm512_cvttpd_epi64(term * splat((double)table->columns) + place);
    return _mm512_i64gather_pd(_mm512_add_epi64(_mm512_loadu_si512(table->rows), _mm512_slli_epi64(at, 3)), NULL, 1);
#elif defined(USE_AVX2) && !defined(SINGLE)
    const __m256i at = _mm256_cvtepi32_epi64(_mm256_cvttpd_epi32(term * splat((double)table->columns) + place));
    const __m256i *rows = (const __m256i *)table->rows;
    return _mm256_i64gather_pd(NULL, _mm256_add_epi64(_mm256_loadu_si256(rows), _mm256_slli_epi64(at, 3)), 1);
#else
    V found = splat(0.0);
    for (int i = 0; i < LANES; i++)
        set_lane(&found, i, table->rows[i][(long)at_lane(term, i) * table->columns + (long)at_lane(place, i)]);
    return found;
#endif
}

MERGED V terrain_entry(const Terrain *table, V row, V column) {
    const V place = v_min(v_max(splat(0.0), column), splat((double)(table->columns - 1)));
    V found = splat(0.0);
    for (int i = 0; i < LANES; i++)
        set_lane(&found, i, table->rows[(long)at_lane(row, i) * table->columns + (long)at_lane(place, i)]);
    return found;
}

MERGED V worst(Mask m, const Run *run, V value) {
    if (LANES == 1 || !run->together) return value;
    const V own = sel(and_(and_(m, run->live), ge(value, value)), value, splat(-INFINITY));
    double found = at_lane(own, 0);
    for (int i = 1; i < LANES; i++) found = max_f(found, at_lane(own, i));
    return splat(found);
}

MERGED V least(Mask m, const Run *run, V value) { return -worst(m, run, -value); }

MERGED Mask anyone(Mask m, const Run *run, Mask condition) {
    return LANES == 1 || !run->together ? condition : lanes_if(any(and_(and_(m, run->live), condition)));
}
