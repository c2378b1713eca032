// Runs experiments in lanes. Each lane advances from event to event (a valve switch, a sample) of its own. Lanes that
// march together share every step, so that one lane's event ends the step of all.

// One simulation.
typedef struct {
    const double *q;
    int64_t active;
    const double *body_curve, *small_curve, *learnt; // learnt: NULL without learnt curves
    double incline_rad, positive_psi, negative_psi, share[3];
    const double *switch_s;
    const int64_t *chamber, *command;
    int64_t switches;
    const double *sample_s, *path; // path: displacements of a static loading, m
    int64_t samples;
    double *rows; // result: for each column, one value per sample
} Job;

typedef struct {
    int64_t parts, free, wall, terrain_columns, curve_rows, learnt_terms, learnt_columns, experiment, together;
    const double *terrain;
    double extended_psi, rate_m_s, load_cell_N_m, tolerance_m, settled, looser;
} Setting;

#ifdef SINGLE
#define NEAR_S 1e-5 // times of up to two minutes are rounded by less
#else
#define NEAR_S ARRIVED_S
#endif

enum { WALK, SEEN, PROGRESS, STEP, ANCHOR };
enum { EXTEND, HOLD, SWITCH, SAMPLE };
enum { POSITIVE = 1, OFF = 2, MOST_COLUMNS = 32 };
static const int COLUMNS_OF[] = {WALK_COLUMNS, 7, 2, 3, 5};

typedef struct {
    const Job *job;
    double *late_s; // times at which the valves switch, in order
    int64_t *order;
    int64_t room, next_switch, next_sample;
    int what;
} Schedule;

typedef struct {
    Plant plant;
    Mounting rig;
    Run run;
    V until;
    Schedule schedule[LANES];
} Bench;

static void set_curve(Curve *curve, int i, const double *rows, long count) {
    curve->rows[i] = rows;
    curve->count = count;
    set_lane(&curve->lower, i, rows[0]);
    set_lane(&curve->upper, i, rows[1]);
    set_lane(&curve->per_width, i, rows[2]);
}

static void set_run(Run *run, int i) {
    for (int k = 0; k < STATES; k++) set_lane(&run->y[k], i, 0.0);
    for (int k = 0; k < MEMORY; k++) set_lane(&run->z[k], i, 0.0);
    for (int k = 0; k < 3; k++) {
        set_lane(&run->clock[k], i, k == 1 ? FIRST_S : 0.0);
        set_lane(&run->command[k], i, OFF);
        set_lane(&run->source[k], i, 0.0);
        set_lane(&run->read[k], i, 0.0);
    }
    set_lane(&run->slip[0], i, 0.0);
}

// Set up a job's robot and mounting in lane i, at rest.
static void mount(Bench *bench, const Setting *setting, const Job *job, int i) {
    Plant *plant = &bench->plant;
    for (int k = 0; k < NUMBERS; k++) set_lane(&plant->q[k], i, job->q[k]);
    plant->active[i] = job->active;
    plant->any = 0;
    plant->same = 1;
    for (int k = 0; k < LANES; k++) {
        plant->any |= plant->active[k];
        plant->same &= plant->active[k] == plant->active[0];
    }
    set_curve(&plant->body_curve, i, job->body_curve, setting->curve_rows);
    set_curve(&plant->small_curve, i, job->small_curve, setting->curve_rows);
    plant->learnt.rows[i] = job->learnt;
    plant->learnt.terms = setting->learnt_terms;
    plant->learnt.columns = setting->learnt_columns;
    Mounting *rig = &bench->rig;
    rig->parts = setting->parts;
    rig->free = setting->free;
    rig->wall = setting->wall;
    rig->looser = setting->looser;
    rig->terrain = (Terrain){setting->terrain, setting->terrain ? 7 : 0, setting->terrain_columns};
    set_lane(&rig->incline_rad, i, job->incline_rad);
    set_lane(&rig->positive_psi, i, job->positive_psi);
    set_lane(&rig->negative_psi, i, job->negative_psi);
    for (int k = 0; k < 3; k++) set_lane(&rig->share[k], i, job->share[k]);
    set_run(&bench->run, i);
}

// Schedule the next event of lane i. Returns 0 after the last sample.
static int plan(Bench *bench, int i) {
    Schedule *s = &bench->schedule[i];
    const Job *job = s->job;
    if (s->next_sample >= job->samples) return 0;
    const double sample_s = job->sample_s[s->next_sample];
    const int switches = s->next_switch < job->switches && s->late_s[s->next_switch] <= sample_s;
    s->what = switches ? SWITCH : SAMPLE;
    set_lane(&bench->until, i, switches ? s->late_s[s->next_switch] : sample_s);
    return 1;
}

// Sort the switching times, including the valves' delays; at equal times the earlier command comes first. A switch
// never takes effect after a later one of the same chamber. Returns 0 if memory runs out.
static int sort_switches(Schedule *s, double to_positive_s, double otherwise_s) {
    const Job *job = s->job;
    if (s->room < job->switches) {
        free(s->late_s);
        free(s->order);
        s->late_s = malloc(sizeof *s->late_s * (size_t)job->switches);
        s->order = malloc(sizeof *s->order * (size_t)job->switches);
        s->room = job->switches;
        if (!s->late_s || !s->order) return 0;
    }
    double next_s[] = {INFINITY, INFINITY, INFINITY};
    for (int64_t k = job->switches - 1; k >= 0; k--) {
        const double late_s = job->switch_s[k] + (job->command[k] == POSITIVE ? to_positive_s : otherwise_s);
        double *next = &next_s[job->chamber[k]];
        s->late_s[k] = *next = fmin(late_s, *next);
    }
    for (int64_t k = 0; k < job->switches; k++) {
        const double late_s = s->late_s[k];
        int64_t at = k;
        for (; at > 0 && s->late_s[at - 1] > late_s; at--) {
            s->late_s[at] = s->late_s[at - 1];
            s->order[at] = s->order[at - 1];
        }
        s->late_s[at] = late_s;
        s->order[at] = k;
    }
    return 1;
}

// Begin a job in lane i. Returns 0 if memory runs out.
static int begin(Bench *bench, const Setting *setting, const Job *job, int i) {
    mount(bench, setting, job, i);
    const Mask m = lane(i);
    Schedule *s = &bench->schedule[i];
    s->job = job;
    s->next_switch = s->next_sample = 0;
    Plant *plant = &bench->plant;
    if (!sort_switches(s, at_lane(delay_of(plant, plant->q, 1), i), at_lane(delay_of(plant, plant->q, 0), i))) return 0;
    switch (setting->experiment) {
        case STEP: start_step(m, plant, &bench->rig, &bench->run); break;
        case ANCHOR: start_anchor(m, plant, &bench->rig, &bench->run); break;
        default: start_walk(m, plant, &bench->rig, &bench->run);
    }
    int more = 1;
    if (setting->experiment == ANCHOR) {
        s->what = EXTEND; // in the first half of the interval before time 0
        set_lane(&bench->rig.positive_psi, i, fmax(job->positive_psi, setting->extended_psi));
        set_lane(&bench->until, i, 0.5 * at_lane(bench->run.clock[0], i));
    } else if (setting->experiment == STEP) {
        s->what = HOLD;
        set_lane(&bench->until, i, 0.0);
    } else {
        more = plan(bench, i);
    }
    bench->run.live = more ? or_(bench->run.live, m) : andnot(m, bench->run.live);
    return 1;
}

// If the last three cycles of a walk advanced alike, to within the share `settled`, extrapolate its progress to the
// other samples.
static void extrapolate(Schedule *s, double settled) {
    const Job *job = s->job;
    const double *head = job->rows + s->next_sample;
    if (s->next_sample < 4) return;
    const double last = head[-1] - head[-2], before = head[-2] - head[-3], first = head[-3] - head[-4];
    if (!(fmax(fabs(last - before), fabs(last - first)) <= settled * fabs(last))) return;
    for (; s->next_sample < job->samples; s->next_sample++)
        for (int c = 0; c < COLUMNS_OF[PROGRESS]; c++) {
            double *out = job->rows + c * job->samples + s->next_sample;
            *out = 2.0 * out[-1] - out[-2];
        }
}

static void sample(Bench *bench, const Setting *setting, Mask m) {
    V row[MOST_COLUMNS];
    Plant *plant = &bench->plant;
    Mounting *rig = &bench->rig;
    Run *run = &bench->run;
    switch (setting->experiment) {
        case WALK: walk_row_of(m, plant, rig, run, row); break;
        case SEEN: seen_row_of(m, plant, rig, run, row); break;
        case PROGRESS: progress_row_of(m, plant, rig, run, row); break;
        case STEP: step_row_of(m, plant, rig, run, row); break;
        default: anchor_row_of(m, plant, rig, run, setting->rate_m_s, setting->load_cell_N_m, row);
    }
    const int columns = COLUMNS_OF[setting->experiment];
    for (int i = 0; i < LANES; i++) {
        Schedule *s = &bench->schedule[i];
        if (!(bits_of(m) >> i & 1)) continue;
        double *out = s->job->rows + s->next_sample;
        for (int c = 0; c < columns; c++) out[c * s->job->samples] = at_lane(row[c], i);
        s->next_sample++;
        if (setting->settled > 0.0) extrapolate(s, setting->settled);
    }
}

// Handle the events at which lanes have arrived; finished lanes take the next job. Returns 0 if memory runs out.
static int happen(Bench *bench, const Setting *setting, Mask arrived, const Job **next, const Job *end) {
    bench->run.clock[0] = sel(arrived, bench->until, bench->run.clock[0]);
    arrive_at(arrived, &bench->plant, &bench->run);
    Mask sampled = no_lanes();
    for (int i = 0; i < LANES; i++)
        if (bits_of(arrived) >> i & 1 && bench->schedule[i].what == SAMPLE) sampled = or_(sampled, lane(i));
    if (any(sampled)) sample(bench, setting, sampled);
    for (int i = 0; i < LANES; i++) {
        Schedule *s = &bench->schedule[i];
        if (!(bits_of(arrived) >> i & 1)) continue;
        if (s->what == SWITCH) {
            const int64_t k = s->order[s->next_switch++];
            const int64_t chamber = setting->experiment == STEP ? (setting->parts & HAS_BODY ? 0 : 1) : s->job->chamber[k];
            set_lane(&bench->run.command[chamber], i, (double)s->job->command[k]);
        }
        if (s->what == EXTEND) {
            s->what = HOLD;
            set_lane(&bench->rig.positive_psi, i, s->job->positive_psi);
            set_lane(&bench->until, i, 0.0);
            continue;
        }
        if (plan(bench, i)) continue;
        bench->run.live = andnot(lane(i), bench->run.live);
        if (*next < end && !begin(bench, setting, (*next)++, i)) return 0;
    }
    return 1;
}

static int run_all(Bench *bench, const Setting *setting, const Job *jobs, const Job *end) {
    const Job *next = jobs;
    bench->run.live = no_lanes();
    for (int i = 0; i < LANES; i++) mount(bench, setting, jobs, i); // so that lanes without a job are defined
    for (int i = 0; i < LANES && next < end; i++)
        if (!begin(bench, setting, next++, i)) return 0;
    const V tolerance = splat(setting->tolerance_m);
    while (any(bench->run.live)) {
        Run *run = &bench->run;
        const Mask left = and_(gt(bench->until - run->clock[0], splat(NEAR_S)), finite_(run->y[0]));
        const Mask arrived = andnot(left, bench->run.live);
        if (any(arrived)) {
            if (!happen(bench, setting, arrived, &next, end)) return 0;
        } else {
            attempt_in(&bench->plant, &bench->rig, run, bench->until, tolerance);
        }
    }
    return 1;
}

static Bench *new_bench(const Setting *setting) {
    Bench *bench = aligned_alloc(64, (sizeof(Bench) + 63) / 64 * 64);
    if (bench) {
        memset(bench, 0, sizeof *bench);
        bench->run.together = (int)setting->together;
    }
    return bench;
}

// Run `count` simulations; those that march together do so in successive packs of LANES. Returns 0, or 1 if memory runs
// out.
int march_jobs(const Setting *setting, const Job *jobs, int64_t count) {
    Bench *bench = new_bench(setting);
    if (!bench) return 1;
    int done = 1;
    if (setting->together) {
        for (int64_t k = 0; k < count && done; k += LANES)
            done = run_all(bench, setting, jobs + k, jobs + (k + LANES < count ? k + LANES : count));
    } else if (count) {
        done = run_all(bench, setting, jobs, jobs + count);
    }
    for (int i = 0; i < LANES; i++) {
        free(bench->schedule[i].late_s);
        free(bench->schedule[i].order);
    }
    free(bench);
    return !done;
}

// Run static loadings, all sampled at the same times. Returns 0, or 1 if memory runs out.
int load_jobs(const Setting *setting, const Job *jobs, int64_t count) {
    const int64_t samples = count ? jobs->samples : 0;
    Bench *bench = new_bench(setting);
    V *path = aligned_alloc(64, sizeof(V) * (size_t)(samples + 8) / 64 * 64 + 64);
    V *out = aligned_alloc(64, sizeof(V) * (size_t)(2 * samples + 8) / 64 * 64 + 64);
    const int ready = bench && path && out;
    for (int64_t first = 0; ready && first < count; first += LANES) {
        for (int i = 0; i < LANES; i++) {
            const Job *job = jobs + (first + i < count ? first + i : first);
            mount(bench, setting, job, i);
            for (int64_t k = 0; k < samples; k++) set_lane(&path[k], i, job->path[k]);
        }
        Rows rows = {out, 2};
        load_rows(&bench->plant, &bench->rig, &bench->run, path, (Series){jobs->sample_s, samples}, &rows);
        for (int i = 0; i < LANES && first + i < count; i++)
            for (int64_t k = 0; k < samples; k++)
                for (int c = 0; c < 2; c++) jobs[first + i].rows[c * samples + k] = at_lane(out[2 * k + c], i);
    }
    free(bench);
    free(path);
    free(out);
    return !ready;
}

int lanes_of_kernel(void) { return LANES; }

// Bits of the effects that could not be translated, and the reasons.
int64_t refused_effects(void) { return REFUSED; }
const char *refusals(void) { return REFUSALS; }
