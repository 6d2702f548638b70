/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces are samples of the dense output: at the ends of steps, between them, and more where forces change quickly.
 * Integrals over the way are trapezoidal; a mean is the difference of two values of the integral, 2 m apart
 * (EN 14363:2016: sliding mean of Y/Q and of the sum of Y, from forces below 20 Hz). */
#include "rail/running_safety.h"
#include "analyses/equilibrium/balances.h"
#include "base/context.h"
#include "base/json.h"
#include "base/memory.h"
#include "constraints/inexact/nearest_exact.h"
#include "constraints/tolerances.h"
#include "dynamics/program_cache.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "output/print.h"
#include "rail/low_pass.h"
#include "studies/simulate/observed.h"
#include "symbolic/table_function.h"
#include <kempe/equilibrium.h>
#include <math.h>
#include <string.h>

/* Way and time between samples of a step, which are halved HALVINGS times at most, where a sample between them is more
 * than STRAIGHT of the wheel's load off the line through both; on tracks with irregularities samples are that near
 * from the beginning. */
static const double SAMPLE_WAY = 0.4, SAMPLE_TIME = 0.04, STRAIGHT = 1e-2;
/* The same in an interval of twice the length: a sample more in its middle would have brought lines as near. */
static const double PAIRED = 2.5e-3;
/* An oscillation whose periods fit between samples is on the line in their middle. So values are compared with the line
 * in two places off the middle too, since one of them may be on it by its phase. An interval with an oscillation is
 * refined everywhere. */
static const double OFF_MIDDLE[] = {0.3, 0.41};
/* Part of Q0 below which Y/Q is a quotient of small forces. */
static const double LEAST_LOAD = 0.05;
/* Wheels are opposite each other that are nearer along the track than this part of its gauge. */
static const double OPPOSITE = 0.25;
/* Places along the track are found to this part of its gauge; the next correction would be smaller by the distance from
 * the middle line over the radius of the curve. */
static const double PLACED = 1e-9;
/* Steps that are shorter by this are sampled together. */
static const double SHORT = 1.0 / 16;
enum { HALVINGS = 4, ROUGH_HALVINGS = 3 };
/* The largest number of samples; places where the flange is looked at. */
enum { MOST_SAMPLES = 40000, FLANGE_PLACES = 4000, COURSE_PLACES = 1000, PROJECTIONS = 6 };
/* Values of a wheel in a sample. */
enum { LOAD, ACROSS, RATIO, WEAR, SPEED, ALONG, ASIDE, OF_WHEEL };

typedef struct judging {
    const kempe_model *model;
    kmp_recording *recording;
    const double *static_loads;
    kmp_running_safety *safety;
    kmp_output_program observed;
    kmp_arena room;
    double from, until;
    int *motion_at;         /* of each wheel: its first columns of velocity and of position */
    double *row, *value;    /* of an instant */
    double *kept, *scratch; /* samples: their time, OF_WHEEL values of each wheel */
    int count;
    double *last, *waiting, *next; /* the last sample that is kept; the one after it, if one waits; the newest */
    bool waits, calm, pairs;       /* calm: the last interval was not refined; pairs: then two are judged together */
    bool full;                     /* MOST_SAMPLES are taken */
    int halvings;
    double *way, *of;               /* way and Y/Q of wheel w at sample k: [w * samples + k] */
    double *smooth, *smooth_across; /* Q and Y at low frequencies, a wheel after the other */
    double *integral;
} judging;

/* -- limits ------------------------------------------------------------------------------------------- */

/* The steepest angle of a wheel's flange, rad. */
static double steepest_flange(const kmp_wheel *wheel)
{
    const kmp_table *height = wheel->profile->height;
    double steepest = 0;
    int tip = 0;
    for (int k = 1; k < height->count && height->x[k] < 0; k++)
        tip = height->y[k] < height->y[tip] ? k : tip;
    const double from = height->x[tip];
    for (int k = 0; k <= FLANGE_PLACES && from < 0; k++)
        steepest = fmax(steepest, kmp_table_value(height, 1, from * (1 - (double)k / FLANGE_PLACES)));
    return atan(steepest);
}

/* -- samples ------------------------------------------------------------------------------------------ */

static kempe_status observe(judging *j)
{
    static const kmp_output_kind kind_of[] = {KMP_OUTPUT_VELOCITY, KMP_OUTPUT_POSITION};
    const kempe_model *model = j->model;
    kmp_text words = {0}, column = {0};
    for (int w = 0; w < model->wheel_count; w++)
        kmp_text_printf(&words, "%sguidance(%s)", w > 0 ? "," : "", model->wheels[w].name);
    for (int w = 0; w < 2 * model->wheel_count; w++) {
        kmp_text_put(&words, ",");
        kmp_output_print(&words, model, &(kmp_output){.kind = kind_of[w % 2], .index = model->wheels[w / 2].point});
    }
    kempe_status status = words.failed ? kmp_fail_memory(model->context)
                                       : kmp_output_program_init(&j->observed, j->observed.system, words.s, 0, NULL);
    kmp_text_free(&words);
    KMP_TRY(status);
    bool made = KMP_ARENA_MAKE(&j->room, KMP_ROOM(int, 2 * model->wheel_count, &j->motion_at),
                               KMP_ROOM(double, j->observed.columns.count, &j->value));
    for (int w = 0; made && w < 2 * model->wheel_count; w++) {
        kmp_text_free(&column);
        kmp_output_column(&column, model, &(kmp_output){.kind = kind_of[w % 2], .index = model->wheels[w / 2].point},
                          0);
        for (int k = 1; !column.failed && k < j->observed.columns.count; k++)
            if (strcmp(j->observed.columns.name[k], column.s) == 0)
                j->motion_at[w] = k - 1;
    }
    made = made && !column.failed;
    kmp_text_free(&column);
    return kmp_made(model->context, made);
}

/* The middle line and its direction at an arc length. */
static void middle_line(const kmp_track *track, double s, double at[2], double along[2])
{
    at[0] = track->curved ? kmp_table_value(track->x, 0, s) : s;
    at[1] = track->curved ? kmp_table_value(track->y, 0, s) : 0;
    along[0] = track->curved ? kmp_table_value(track->x, 1, s) : 1;
    along[1] = track->curved ? kmp_table_value(track->y, 1, s) : 0;
}

/* The nearest of many places. */
static double nearest_place(const kmp_track *track, const double p[2])
{
    double best = p[0], least = INFINITY, at[2], along[2];
    for (int k = 0; track->curved && k <= COURSE_PLACES; k++) {
        double s = track->length * k / COURSE_PLACES;
        middle_line(track, s, at, along);
        double far = hypot(p[0] - at[0], p[1] - at[1]);
        best = far < least ? s : best;
        least = fmin(least, far);
    }
    return best;
}

/* The arc length below the centre of a wheel, by Newton's method without the curvature, and the place across, in the
 * plane of the canted track. */
static void place_on_track(const judging *j, int wheel, double guess, double *arc, double *aside)
{
    const kmp_track *track = &j->model->tracks[j->model->wheels[wheel].track];
    const kmp_point *point = &j->model->points[track->point];
    const double *position = j->value + j->motion_at[2 * wheel + 1];
    double p[3] = {0, 0, 0}, at[2], along[2];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            p[k] += (point->turned ? point->axes[i][k] : i == k) * (position[i] - point->at[i].value);
    double s = isfinite(guess) ? guess : nearest_place(track, p);
    double off = INFINITY;
    for (int k = 0; k < PROJECTIONS && fabs(off) > PLACED * track->gauge; k++) {
        middle_line(track, s, at, along);
        off = (p[0] - at[0]) * along[0] + (p[1] - at[1]) * along[1];
        s += off;
    }
    middle_line(track, s, at, along);
    double cant = track->curved && track->cant ? kmp_table_value(track->cant, 0, s) : 0;
    double left = (p[1] - at[1]) * along[0] - (p[0] - at[0]) * along[1];
    *arc = s;
    *aside = left * cos(cant) + p[2] * sin(cant);
}

static int sample_size(const judging *j)
{
    return 1 + OF_WHEEL * j->model->wheel_count;
}

/* A sample at t; `before`: one nearby, NULL: there is none. */
static kempe_status take_sample(judging *j, double t, const double *before, double *sample)
{
    int n = j->observed.system->n;
    KMP_TRY(kmp_recording_row(j->recording, t, j->observed.late, j->row));
    kmp_output_program_at(&j->observed, t, j->row, j->row + n, j->row + 2 * n, j->row + 3 * n, j->value);
    sample[0] = t;
    for (int w = 0; w < j->model->wheel_count; w++) {
        double *of = sample + 1 + OF_WHEEL * w;
        for (int k = LOAD; k <= WEAR; k++)
            of[k] = j->value[4 * w + k];
        const double *v = j->value + j->motion_at[2 * w];
        of[SPEED] = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        place_on_track(j, w, before ? before[1 + OF_WHEEL * w + ALONG] : NAN, &of[ALONG], &of[ASIDE]);
    }
    return KEMPE_OK;
}

static kempe_status keep(judging *j, const double *sample)
{
    const size_t size = (size_t)sample_size(j) * sizeof *sample;
    double *room = kmp_arena_room(&j->room, j->kept, j->count, size);
    KMP_TRY(kmp_made(j->model->context, room));
    j->kept = room;
    memcpy(room + (ptrdiff_t)j->count++ * sample_size(j), sample, size);
    return KEMPE_OK;
}

/* True if a sample is nearly on the lines between two others, as many of the wheels as touch the rail. */
static bool is_straight(const judging *j, double off_most, const double *a, const double *middle, const double *b)
{
    const double part = (middle[0] - a[0]) / (b[0] - a[0]);
    for (int w = 0; w < j->model->wheel_count; w++) {
        const int at = 1 + OF_WHEEL * w;
        double load = j->static_loads[w];
        load = isfinite(load) && load > 0 ? load : fmax(fabs(j->kept[at + LOAD]), 1);
        for (int k = at; k <= at + RATIO; k++) {
            double off = fabs(middle[k] - a[k] - part * (b[k] - a[k])), size = k == at + RATIO ? 1 : load;
            if (off > off_most * size)
                return false;
        }
    }
    return true;
}

/* Tests whether values oscillate between two samples although their middle is on the line; uses scratch. */
static kempe_status find_oscillation(judging *j, const double *a, const double *b, double *scratch, bool *found)
{
    *found = false;
    for (int k = 0; !*found && k < 2; k++) {
        KMP_TRY(take_sample(j, a[0] + (b[0] - a[0]) * OFF_MIDDLE[k], a, scratch));
        *found = !is_straight(j, STRAIGHT, a, scratch, b);
    }
    return KEMPE_OK;
}

/* Keeps the samples after `a` up to `b`, with samples between where values are not straight; `whole`: everywhere. */
static kempe_status refine(judging *j, const double *a, const double *b, int halvings, bool whole, double *scratch)
{
    double *middle = scratch, *rest = scratch + sample_size(j);
    KMP_TRY(take_sample(j, a[0] + (b[0] - a[0]) / 2, a, middle));
    bool full = j->count > MOST_SAMPLES && !j->full;
    if (full)
        kmp_doubt(j->model->context,
                  "running safety: %d samples are taken up to t = %.6g s; later ones are not refined: evaluate a "
                  "shorter time",
                  MOST_SAMPLES, a[0]);
    j->full = j->full || full;
    bool end = halvings == 0 || j->full;
    if (!end && !whole && is_straight(j, STRAIGHT, a, middle, b)) {
        KMP_TRY(find_oscillation(j, a, b, rest, &whole));
        end = !whole;
    }
    if (end) {
        KMP_TRY(keep(j, middle));
        return keep(j, b);
    }
    KMP_TRY(refine(j, a, middle, halvings - 1, whole, rest));
    return refine(j, middle, b, halvings - 1, whole, rest);
}

/* Refines an interval; calm: one sample was enough. */
static kempe_status refine_interval(judging *j, const double *from, const double *to)
{
    const int count = j->count;
    KMP_TRY(refine(j, from, to, j->halvings, false, j->scratch));
    j->calm = j->pairs && j->count == count + 2;
    return KEMPE_OK;
}

static void exchange(double **a, double **b)
{
    double *kept = *a;
    *a = *b;
    *b = kept;
}

/* Goes on to the next sample. After an interval without refinement two intervals are a pair, which is not refined where
 * the sample between them is on the line. Either way an even number of samples is kept. */
static kempe_status go_on(judging *j)
{
    if (!j->waits && j->calm) {
        exchange(&j->waiting, &j->next);
        j->waits = true;
        return KEMPE_OK;
    }
    bool oscillates = false, paired = j->waits && is_straight(j, PAIRED, j->last, j->waiting, j->next);
    if (paired)
        KMP_TRY(find_oscillation(j, j->last, j->next, j->scratch, &oscillates));
    if (paired && !oscillates) {
        KMP_TRY(keep(j, j->waiting));
        KMP_TRY(keep(j, j->next));
    } else {
        if (j->waits)
            KMP_TRY(refine_interval(j, j->last, j->waiting));
        KMP_TRY(refine_interval(j, j->waits ? j->waiting : j->last, j->next));
    }
    j->waits = false;
    exchange(&j->last, &j->next);
    return KEMPE_OK;
}

/* Parts of a time, each of which begins with a sample. */
static double parts_of(const judging *j, double span, const double *sample)
{
    double fastest = 0;
    for (int w = 0; w < j->model->wheel_count; w++)
        fastest = fmax(fastest, sample[1 + OF_WHEEL * w + SPEED]);
    return span * fmax(1 / SAMPLE_TIME, fastest / SAMPLE_WAY);
}

static const double *last_sample(const judging *j)
{
    return j->waits ? j->waiting : j->last;
}

/* The samples of a step, after the one at its start. */
static kempe_status sample_step(judging *j, double to, double finer)
{
    const double from = last_sample(j)[0];
    double parts = ceil(fmin(finer * parts_of(j, to - from, last_sample(j)), MOST_SAMPLES));
    for (int k = 1; k <= fmax(parts, 1); k++) {
        KMP_TRY(take_sample(j, k < parts ? from + (to - from) * k / parts : to, last_sample(j), j->next));
        KMP_TRY(go_on(j));
    }
    return KEMPE_OK;
}

/* By wheels, with the way, which is the integral of the speed. */
static void sort_samples(judging *j)
{
    kmp_running_safety *s = j->safety;
    const int samples = s->samples;
    for (int k = 0; k < samples; k++)
        s->t[k] = j->kept[(ptrdiff_t)k * sample_size(j)];
    for (int w = 0; w < j->model->wheel_count; w++) {
        double *way = j->way + (ptrdiff_t)w * samples, before = 0;
        for (int k = 0; k < samples; k++) {
            const double *of = j->kept + (ptrdiff_t)k * sample_size(j) + 1 + OF_WHEEL * w;
            const ptrdiff_t at = (ptrdiff_t)w * samples + k;
            s->load[at] = of[LOAD];
            s->across[at] = of[ACROSS];
            j->of[at] = of[RATIO];
            s->wear[at] = of[WEAR];
            s->along[at] = of[ALONG];
            s->aside[at] = of[ASIDE];
            way[k] = k > 0 ? way[k - 1] + (s->t[k] - s->t[k - 1]) * (before + of[SPEED]) / 2 : 0;
            before = of[SPEED];
        }
        s->way = fmax(s->way, way[samples - 1]);
    }
}

/* -- values ------------------------------------------------------------------------------------------- */

static void take_largest(kmp_safety_value *largest, double value, double t)
{
    if (isfinite(value) && !(value <= largest->value))
        *largest = (kmp_safety_value){value, t};
}

/* mean of x over the way before every stride-th sample; NaN where the way is too short. */
static void slide(const judging *j, int stride, const double *way, const double *x, double *mean)
{
    const int samples = j->safety->samples;
    double *integral = j->integral;
    integral[0] = 0;
    for (int k = 0, back = 0; k < samples; k += stride) {
        if (k > 0)
            integral[k] = integral[k - stride] + (way[k] - way[k - stride]) * (x[k] + x[k - stride]) / 2;
        double begin = way[k] - KMP_SAFETY_LENGTH;
        mean[k] = NAN;
        if (begin < 0)
            continue;
        while (way[back + stride] <= begin && back + stride < k)
            back += stride;
        double part = (begin - way[back]) / (way[back + stride] - way[back]);
        double first = x[back] + part * (x[back + stride] - x[back]);
        double before = integral[back] + (begin - way[back]) * (x[back] + first) / 2;
        mean[k] = (integral[k] - before) / KMP_SAFETY_LENGTH;
    }
}

static double unloading(const kmp_safety_wheel *wheel, double load)
{
    return wheel->load > 0 ? (wheel->load - load) / wheel->load : NAN;
}

static void judge_wheel(const judging *j, int w, int stride, kmp_safety_wheel *out)
{
    const int samples = j->safety->samples;
    const ptrdiff_t at = (ptrdiff_t)w * samples;
    const double *load = j->safety->load + at, *smooth = j->smooth + at, *of = j->of + at, *t = j->safety->t;
    double *mean = j->safety->mean + at, *ratio = j->integral + samples;
    out->unloading = out->smooth_unloading = out->ratio = out->mean = out->most_wear = (kmp_safety_value){NAN, NAN};
    /* The mean of the wear over the whole way; NaN without a way. */
    const double *way = j->way + at, *x = j->safety->wear + at;
    double sum = 0;
    for (int k = stride; k < samples; k += stride)
        sum += (way[k] - way[k - stride]) * (x[k] + x[k - stride]) / 2;
    out->wear = way[samples - 1] > 0 ? sum / way[samples - 1] : NAN;
    for (int k = 0; k < samples; k += stride)
        ratio[k] = smooth[k] > 0 ? j->smooth_across[at + k] / smooth[k] : 0;
    slide(j, stride, j->way + at, ratio, mean);
    for (int k = 0; k < samples; k += stride) {
        take_largest(&out->unloading, unloading(out, load[k]), t[k]);
        take_largest(&out->smooth_unloading, unloading(out, smooth[k]), t[k]);
        take_largest(&out->ratio, load[k] < LEAST_LOAD * out->load ? NAN : of[k], t[k]);
        take_largest(&out->mean, mean[k], t[k]);
        take_largest(&out->most_wear, j->safety->wear[at + k], t[k]);
    }
}

/* The sum of the forces to the left. */
static void judge_axle(const judging *j, int number, int stride, kmp_safety_axle *out)
{
    const int samples = j->safety->samples;
    const ptrdiff_t left = (ptrdiff_t)out->left * samples, right = (ptrdiff_t)out->right * samples;
    double *sum = j->safety->sum + (ptrdiff_t)number * samples, *force = j->integral + samples;
    for (int k = 0; k < samples; k++)
        force[k] = j->smooth_across[left + k] - j->smooth_across[right + k];
    slide(j, stride, j->way + left, force, sum);
    out->mean = (kmp_safety_value){NAN, NAN};
    for (int k = 0; k < samples; k += stride)
        take_largest(&out->mean, fabs(sum[k]), j->safety->t[k]);
}

static double change(kmp_safety_value fine, kmp_safety_value coarse, double least)
{
    return isfinite(fine.value) && isfinite(coarse.value)
               ? fabs(fine.value - coarse.value) / fmax(fabs(fine.value), least)
               : 0;
}

static bool judge_with(const judging *j, int stride, kmp_safety_wheel *wheel, kmp_safety_axle *axle)
{
    const kmp_running_safety *s = j->safety;
    bool made = kmp_low_pass(KMP_SAFETY_CUTOFF, s->samples, stride, s->t, s->wheels, s->load, j->smooth) &&
                kmp_low_pass(KMP_SAFETY_CUTOFF, s->samples, stride, s->t, s->wheels, s->across, j->smooth_across);
    for (int w = 0; made && w < s->wheels; w++)
        judge_wheel(j, w, stride, &wheel[w]);
    for (int k = 0; made && k < s->axles; k++)
        judge_axle(j, k, stride, &axle[k]);
    return made;
}

/* First with every other sample, then with all. Ratios are compared with 1, forces with the load, wear numbers with the
 * largest. */
static kempe_status judge_all(judging *j)
{
    kmp_running_safety *s = j->safety;
    kmp_safety_wheel *wheel = KMP_ARENA_NEW(&j->room, kmp_safety_wheel, s->wheels);
    kmp_safety_axle *axle = KMP_ARENA_NEW(&j->room, kmp_safety_axle, s->axles + 1);
    KMP_TRY(kmp_made(j->model->context, wheel && axle));
    memcpy(wheel, s->wheel, (size_t)s->wheels * sizeof *wheel);
    memcpy(axle, s->axle, (size_t)s->axles * sizeof *axle);
    KMP_TRY(kmp_made(j->model->context, judge_with(j, 2, wheel, axle) && judge_with(j, 1, s->wheel, s->axle)));
    for (int w = 0; w < s->wheels; w++) {
        const kmp_safety_wheel *a = &s->wheel[w], *b = &wheel[w];
        s->difference = fmax(fmax(s->difference, change(a->unloading, b->unloading, 1)),
                             fmax(change(a->ratio, b->ratio, 1), change(a->mean, b->mean, 1)));
    }
    /* The largest change of wear numbers over the largest of all wheels. */
    double most = 0, off = 0;
    for (int w = 0; w < s->wheels; w++) {
        most = fmax(most, s->wheel[w].most_wear.value);
        off = fmax(off, fmax(fabs(s->wheel[w].wear - wheel[w].wear),
                             fabs(s->wheel[w].most_wear.value - wheel[w].most_wear.value)));
    }
    s->difference = fmax(s->difference, (most > 0 ? off / most : 0));
    for (int k = 0; k < s->axles; k++) {
        double load = s->wheel[axle[k].left].load + s->wheel[axle[k].right].load;
        s->difference =
            fmax(s->difference, change(s->axle[k].mean, axle[k].mean, isfinite(load) ? fmax(load, 1) : 1e4));
    }
    return KEMPE_OK;
}

/* -- the model ---------------------------------------------------------------------------------------- */

/* The wheel on the other rail that is nearest along the track at the start; -1: none is opposite. */
static int opposite(const judging *j, int wheel)
{
    const kempe_model *model = j->model;
    const kmp_wheel *given = &model->wheels[wheel];
    const ptrdiff_t samples = j->safety->samples;
    double least = OPPOSITE * model->tracks[given->track].gauge;
    int found = -1;
    for (int w = 0; w < model->wheel_count; w++) {
        const double far = fabs(j->safety->along[w * samples] - j->safety->along[wheel * samples]);
        if (model->wheels[w].track == given->track && model->wheels[w].side != given->side && far < least) {
            least = far;
            found = w;
        }
    }
    return found;
}

static void take_loads(judging *j)
{
    kmp_running_safety *s = j->safety;
    const kempe_model *model = j->model;
    double loads = 0, least = INFINITY, mass = 0, g = 0;
    s->at_rest = isfinite(j->static_loads[0]);
    s->resumed = s->t[0] > 0;
    for (int w = 0; w < s->wheels; w++) {
        kmp_safety_wheel *wheel = &s->wheel[w];
        wheel->load = s->at_rest ? j->static_loads[w] : j->safety->load[(ptrdiff_t)w * s->samples];
        wheel->flange = steepest_flange(&model->wheels[w]);
        /* Nadal, Annales des Mines 9 (1896) 413. */
        const double slope = tan(wheel->flange), friction = model->wheels[w].friction.value;
        wheel->nadal = slope > friction ? (slope - friction) / (1 + friction * slope) : NAN;
        loads += wheel->load;
        least = fmin(least, wheel->load);
    }
    for (int b = 1; b < model->body_count; b++)
        mass += kmp_body_undeformed(model, b).mass.value;
    for (int i = 0; i < 3; i++)
        g = hypot(g, model->gravity[i].value);
    s->carried = mass * g > 0 ? loads / (mass * g) : NAN;
    s->loaded = s->at_rest || (!s->resumed && least > 0 && !(s->carried > KMP_CARRIED_MOST));
    for (int w = 0; w < s->wheels && !s->loaded; w++)
        s->wheel[w].load = NAN;
}

static kempe_status judge(judging *j, kmp_arena *arena)
{
    kmp_running_safety *s = j->safety;
    const ptrdiff_t wheels = j->model->wheel_count;
    KMP_TRY(observe(j));
    j->row = KMP_ARENA_NEW(&j->room, double, 3 * j->observed.system->n + j->observed.system->m);
    KMP_TRY(kmp_made(j->model->context, j->row));
    /* An odd number of samples, so that every other one ends where all do. */
    bool rough = kmp_tracks_are_irregular(j->model->track_count, j->model->tracks);
    const int steps = kmp_recording_steps(j->recording);
    double finer = rough ? 1 << ROUGH_HALVINGS : 1;
    j->halvings = rough ? HALVINGS - ROUGH_HALVINGS : HALVINGS;
    j->pairs = !rough;
    KMP_TRY(kmp_made(j->model->context,
                     KMP_ARENA_MAKE(&j->room, KMP_ROOM(double, sample_size(j), &j->last, &j->waiting, &j->next),
                                    KMP_ROOM(double, (HALVINGS + 2) * sample_size(j), &j->scratch))));
    KMP_TRY(take_sample(j, j->from, NULL, j->last));
    KMP_TRY(keep(j, j->last));
    finer = fmin(finer, MOST_SAMPLES / (4 * parts_of(j, j->until - j->from, j->last)));
    for (int k = 0; k < steps; k++) {
        double to = kmp_recording_step_end(j->recording, k);
        if (k + 1 == steps || to - last_sample(j)[0] > SHORT * SAMPLE_TIME)
            KMP_TRY(sample_step(j, to, finer));
    }
    KMP_TRY(j->waits ? refine_interval(j, j->last, j->waiting) : KEMPE_OK);
    s->samples = j->count;
    bool made =
        KMP_ARENA_MAKE(&j->room, KMP_ROOM(double, wheels * s->samples, &j->way, &j->of, &j->smooth, &j->smooth_across),
                       KMP_ROOM(double, 2 * (ptrdiff_t)s->samples, &j->integral)) &&
        KMP_ARENA_MAKE(arena,
                       KMP_ROOM(double, wheels * s->samples, &s->load, &s->across, &s->wear, &s->mean, &s->sum,
                                &s->along, &s->aside),
                       KMP_ROOM(double, s->samples, &s->t), KMP_ROOM(kmp_safety_wheel, wheels, &s->wheel),
                       KMP_ROOM(kmp_safety_axle, wheels, &s->axle));
    KMP_TRY(kmp_made(j->model->context, made));
    sort_samples(j);
    s->wheels = (int)wheels;
    take_loads(j);
    /* A wheelset, or two independent wheels. */
    for (int w = 0; w < s->wheels; w++) {
        int right = j->model->wheels[w].side == KMP_TRACK_LEFT ? opposite(j, w) : -1;
        if (right < 0 || opposite(j, right) != w)
            continue;
        /* Prud'homme, Revue Generale des Chemins de Fer 86 (1967) 89; EN 14363 with the factor 1. */
        double load = s->wheel[w].load + s->wheel[right].load;
        s->axle[s->axles++] = (kmp_safety_axle){.left = w, .right = right, .limit = load > 0 ? 10e3 + load / 3 : NAN};
    }
    return judge_all(j);
}

/* Judges a recorded run from samples of its dense output. Without wheels, or without two recorded times, wheels is 0.
 * Arrays are in the arena. KEMPE_E_MEMORY; other statuses of outputs. */
static kempe_status judge_run(const kempe_system *system, kmp_recording *recording, const void *before,
                              kmp_arena *arena, void **verdict)
{
    kmp_running_safety found = {.carried = NAN}, *safety = KMP_ARENA_NEW(arena, kmp_running_safety, 1);
    judging j = {.model = system->model,
                 .recording = recording,
                 .static_loads = before,
                 .safety = &found,
                 .observed = {.system = system}};
    *verdict = safety;
    KMP_TRY(kmp_made(system->context, safety));
    *safety = (kmp_running_safety){.carried = NAN};
    safety->too_long = system->model->wheel_count > 0 && kmp_recording_is_over(recording);
    if (system->model->wheel_count == 0 || !kmp_recording_ends(recording, &j.from, &j.until) || !(j.until > j.from))
        return KEMPE_OK;
    kempe_status status = judge(&j, arena);
    kmp_output_program_free(&j.observed);
    kmp_arena_free(&j.room);
    if (status == KEMPE_OK)
        *safety = found;
    return status;
}

/* -- words -------------------------------------------------------------------------------------------- */

static const double degrees = 57.295779513082320876798154814105;

const char *kmp_safety_loads_from(const kmp_running_safety *s)
{
    return s->at_rest   ? "at the equilibrium"
           : s->loaded  ? "at the start"
           : s->resumed ? "unknown: no equilibrium is found, and the start is before the checkpoint"
                        : "unknown: no equilibrium is found, and at the start the wheels do not carry the weight";
}

/* Forces are in kN where the chosen system of units leaves them in N. */
static kmp_shown force_shown(const kempe_model *model)
{
    return kmp_print_customary(model->context, "N", (kmp_shown){"kN", 1e-3});
}

/* The answer in a line: wheels without load, and the wheels and the axle that come closest to their limits. */
static void show_answer(kmp_text *text, const kempe_model *model, const kmp_running_safety *s)
{
    const kmp_safety_wheel *worst = NULL, *lightest = NULL;
    int lifted = 0;
    const kmp_safety_axle *axle = NULL;
    int above = 0, judged = 0;
    for (int w = 0; w < s->wheels; w++) {
        const double part = s->wheel[w].mean.value / s->wheel[w].nadal;
        judged += isfinite(part);
        above += part > 1;
        if (isfinite(part) && (!worst || part > worst->mean.value / worst->nadal))
            worst = &s->wheel[w];
        const double unloading = s->wheel[w].unloading.value;
        lifted += isfinite(unloading) && unloading >= 1;
        if (isfinite(unloading) && (!lightest || unloading > lightest->unloading.value))
            lightest = &s->wheel[w];
    }
    for (int k = 0; k < s->axles; k++) {
        const double part = s->axle[k].mean.value / s->axle[k].limit;
        judged += isfinite(part);
        above += part > 1;
        if (isfinite(part) && (!axle || part > axle->mean.value / axle->limit))
            axle = &s->axle[k];
    }
    if (judged == 0 && !lightest)
        return;
    kmp_text words = {0};
    if (lightest && lifted > 0)
        kmp_text_printf(&words, "%d of %d wheels without load at times ('%s' at t = %.6g s)", lifted, s->wheels,
                        model->wheels[lightest - s->wheel].name, lightest->unloading.t);
    if (lifted > 0 && judged > 0)
        kmp_text_put(&words, "; ");
    if (above > 0)
        kmp_text_printf(&words, "%d of %d limit%s exceeded", above, judged, judged == 1 ? "" : "s");
    else if (judged > 0)
        kmp_text_printf(&words, "%s%d limit%s kept", judged > 1 ? "all " : "", judged, judged == 1 ? "" : "s");
    if (lifted == 0 && lightest)
        kmp_text_printf(&words, "%sleast load of a wheel %.3g of Q0 ('%s' at t = %.6g s)", words.length > 0 ? "; " : "",
                        1 - lightest->unloading.value, model->wheels[lightest - s->wheel].name, lightest->unloading.t);
    if (worst)
        kmp_text_printf(&words, "; largest Y/Q over 2 m %.3f of %.3f ('%s')", worst->mean.value, worst->nadal,
                        model->wheels[worst - s->wheel].name);
    const kmp_shown force = force_shown(model);
    if (axle)
        kmp_text_printf(&words, "; largest sum of Y %.4g of %.4g %s ('%s' and '%s')",
                        kmp_print_clean(axle->mean.value * force.factor, KMP_PRINT_NOISE * axle->limit),
                        axle->limit * force.factor, force.unit, model->wheels[axle->left].name,
                        model->wheels[axle->right].name);
    kmp_print_wrapped(text, "safety    ", 10, words.s ? words.s : "");
    kmp_text_free_part(text, &words);
}

/* A paragraph; nothing without wheels. */
static void show_verdict(kmp_text *text, const kempe_model *model, const void *verdict)
{
    const kmp_running_safety *s = verdict;
    const kmp_shown force = force_shown(model), wear = kmp_shown_as(model->context, "J/m");
    const int wide = (int)fmax(6, 4 + (double)strlen(force.unit)); /* of loads; SI has few digits */
    int width = 4;
    if (s->too_long)
        kmp_text_put(text, "safety    not evaluated: the dense output of the run needs too much memory; use a shorter\n"
                           "          run, or a larger rtol\n");
    if (s->wheels == 0)
        return;
    for (int w = 0; w < s->wheels; w++)
        width = (int)fmax(width, (double)strlen(model->wheels[w].name));
    show_answer(text, model, s);
    kmp_text_printf(
        text, "running   %-*s  %*s%s  (Q0-Q)/Q0     t, s  at %g Hz  max Y/Q  over 2 m     t, s  Nadal  flange, deg\n",
        width, "", wide - (int)strlen(force.unit), "Q0, ", force.unit, KMP_SAFETY_CUTOFF);
    for (int w = 0; w < s->wheels; w++) {
        const kmp_safety_wheel *wheel = &s->wheel[w];
        kmp_print_cells(text, "          %-*s  %*.2f  %9.3f  %7.3f  %8.3f  %7.3f  %8.3f  %7.3f  %5.3f  %11.2f%s\n",
                        width, model->wheels[w].name, wide, wheel->load * force.factor, wheel->unloading.value,
                        wheel->unloading.t, wheel->smooth_unloading.value, wheel->ratio.value, wheel->mean.value,
                        wheel->mean.t, wheel->nadal, degrees * wheel->flange,
                        wheel->mean.value > wheel->nadal ? "  above the limit" : "");
    }
    for (int k = 0; k < s->axles; k++) {
        const kmp_safety_axle *axle = &s->axle[k];
        kmp_text_printf(text, "          '%s' and '%s': ", model->wheels[axle->left].name,
                        model->wheels[axle->right].name);
        if (isfinite(axle->mean.value))
            kmp_text_printf(text, "sum of Y over 2 m %.3f %s at t = %.6g s", axle->mean.value * force.factor,
                            force.unit, axle->mean.t);
        else
            kmp_text_put(text, "sum of Y over 2 m: unknown");
        if (isfinite(axle->limit))
            kmp_text_printf(text, ", Prud'homme's limit %.3f %s%s", axle->limit * force.factor, force.unit,
                            axle->mean.value > axle->limit ? ", above the limit" : "");
        kmp_text_put(text, "\n");
    }
    kmp_text_printf(text, "          %-*s  T gamma, %s: mean   largest      t, s\n", width, "", wear.unit);
    for (int w = 0; w < s->wheels; w++) {
        const kmp_safety_wheel *wheel = &s->wheel[w];
        kmp_print_cells(text, "          %-*s  %*.4g  %8.4g  %8.3f\n", width, model->wheels[w].name,
                        15 + (int)strlen(wear.unit), wheel->wear * wear.factor, wheel->most_wear.value * wear.factor,
                        wheel->most_wear.t);
    }
    kmp_text words = {0};
    kmp_print_quantity(&words, model->context, 6, s->way, "m");
    kmp_text_put(&words, " travelled");
    if (s->resumed)
        kmp_text_printf(&words, " from t = %.6g s on, where the checkpoint ends", s->t[0]);
    kmp_text_printf(&words, "; Q0 %s", kmp_safety_loads_from(s));
    if (isfinite(s->carried) && s->loaded)
        kmp_text_printf(&words, ", together %.3f of the weight", s->carried);
    kmp_text_printf(&words, "; sampling error %.1e (%d samples)", s->difference, s->samples);
    kmp_print_wrapped(text, "          ", 10, words.s ? words.s : "");
    kmp_text_free_part(text, &words);
    if (s->way < KMP_SAFETY_LENGTH)
        kmp_text_put(text, "          the distance is too short for means over 2 m\n");
}

static void json_value(kmp_json *json, const char *key, kmp_safety_value x)
{
    kmp_json_put(json, "%s { value %g t %g }", key, x.value, x.t);
}

/* true, false, or null if either is unknown. */
static void json_kept(kmp_json *json, double value, double limit)
{
    if (isfinite(value) && isfinite(limit))
        kmp_json_boolean(json, "kept", value <= limit);
    else
        kmp_json_string(json, "kept", NULL);
}

/* The member running_safety; none without wheels. */
static void json_verdict(kmp_json *json, const kempe_model *model, const void *verdict)
{
    const kmp_running_safety *s = verdict;
    if (s->too_long)
        kmp_json_put(json, "running_safety { too_long %i }", true);
    if (s->wheels == 0)
        return;
    kmp_json_put(
        json,
        "running_safety { from %g way %g mean_over %g cutoff %g Q0_at %s samples %d difference %g carried %g wheels [",
        s->t[0], s->way, KMP_SAFETY_LENGTH, KMP_SAFETY_CUTOFF,
        s->at_rest  ? "equilibrium"
        : s->loaded ? "start"
                    : "unknown",
        s->samples, s->difference, s->carried);
    for (int w = 0; w < s->wheels; w++) {
        const kmp_safety_wheel *wheel = &s->wheel[w];
        kmp_json_put(json, "{ name %s Q0 %g", model->wheels[w].name, wheel->load);
        json_value(json, "unloading", wheel->unloading);
        json_value(json, "unloading_filtered", wheel->smooth_unloading);
        json_value(json, "YQ", wheel->ratio);
        json_value(json, "YQ_mean", wheel->mean);
        kmp_json_number(json, "wear_mean", wheel->wear);
        json_value(json, "wear", wheel->most_wear);
        kmp_json_put(json, "flange_angle %g friction %g nadal %g", wheel->flange, model->wheels[w].friction.value,
                     wheel->nadal);
        json_kept(json, wheel->mean.value, wheel->nadal);
        kmp_json_end(json);
    }
    kmp_json_put(json, "] axles [");
    for (int k = 0; k < s->axles; k++) {
        const kmp_safety_axle *axle = &s->axle[k];
        kmp_json_put(json, "{ left %s right %s", model->wheels[axle->left].name, model->wheels[axle->right].name);
        json_value(json, "Y_mean", axle->mean);
        kmp_json_number(json, "prudhomme", axle->limit);
        json_kept(json, axle->mean.value, axle->limit);
        kmp_json_end(json);
    }
    kmp_json_put(json, "] }");
}

/* -- static loads -------------------------------------------------------------------------------------- */

/* Wheel loads at rest take an equilibrium, which costs as much as some seconds of a run; they depend only on the
 * model, and are kept like its programs. */

/* By descent, then by Newton's method. */
static kempe_status loads_at_rest(const kempe_system *system, kmp_output_program *o, kmp_arena *room, double *loads)
{
    kempe_equilibrium *e = NULL;
    double *value = KMP_ARENA_NEW(room, double, o->columns.count), least = INFINITY;
    kempe_status status = kmp_made(system->context, value);
    for (int newton = 0; newton < 2 && !e && status != KEMPE_E_MEMORY && status != KEMPE_STOPPED; newton++)
        status = kmp_equilibrium_states_new(system, newton, &e);
    if (status == KEMPE_OK && e->count > 0 && !e->averaged) {
        const kmp_balance *b = &e->balance[0];
        kmp_output_program_at(o, 0, b->q, b->qd, NULL, b->lambda, value);
        for (int w = 0; w < system->model->wheel_count; w++)
            least = fmin(least, loads[w] = value[4 * w]);
    }
    for (int w = 0; w < system->model->wheel_count && !(isfinite(least) && least > 0); w++)
        loads[w] = NAN;
    kempe_equilibrium_free(e);
    return status == KEMPE_E_MEMORY || status == KEMPE_STOPPED ? status : KEMPE_OK;
}

static kempe_status loads_of(const kempe_system *system, kmp_arena *room, double *loads)
{
    kmp_output_program o;
    kmp_text words = {0};
    for (int w = 0; w < system->model->wheel_count; w++)
        kmp_text_printf(&words, "%sguidance(%s)", w > 0 ? "," : "", system->model->wheels[w].name);
    kempe_status status =
        words.failed ? kmp_fail_memory(system->context) : kmp_output_program_init(&o, system, words.s, 0, NULL);
    kmp_text_free(&words);
    KMP_TRY(status);
    status = loads_at_rest(system, &o, room, loads);
    kmp_output_program_free(&o);
    return status;
}

static kempe_status find(const kempe_system *system, double *loads)
{
    kempe_model ideal;
    kempe_system *level = NULL;
    kmp_arena room = {0};
    kempe_status status = KEMPE_OK;
    const bool quiet = kmp_context_quiet(system->context, true);
    if (kmp_tracks_are_irregular(system->model->track_count, system->model->tracks)) {
        /* A copy whose tracks are ideal, with the parts of the given one. */
        ideal = *system->model;
        ideal.source.has_digest = false; /* its equations are others */
        ideal.tracks = kmp_tracks_ideal(ideal.track_count, ideal.tracks, &room);
        status = kmp_made(system->context, ideal.tracks);
        if (status == KEMPE_OK)
            status = kmp_system_new(&ideal, NULL, &level);
        if (status == KEMPE_OK)
            kempe_system_set_force(level, system->force, system->force_user);
    }
    if (status == KEMPE_OK)
        status = loads_of(level ? level : system, &room, loads);
    kempe_system_free(level);
    (void)kmp_context_quiet(system->context, quiet);
    if (status == KEMPE_OK)
        kmp_context_clear(system->context);
    kmp_arena_free(&room);
    return status;
}

/* Wheel loads (one a wheel) at the equilibrium that is found from the start, on tracks without irregularities; NaN:
 * there is none, or a wheel has no load there. Kept in the context's cache. Ends messages and warnings of the context.
 * KEMPE_E_MEMORY, KEMPE_STOPPED. */
static kempe_status take_static_loads(const kempe_system *system, double *loads)
{
    const kempe_model *model = system->model;
    if (!system->has_key || system->force) /* nothing is known of the force of a user's function */
        return find(system, loads);
    /* By the values of parameters, which may differ from the values of the model's file. */
    kmp_program_cache_name name = {.what = "static loads"};
    kmp_digest digest;
    kmp_digest_begin(&digest);
    kmp_digest_add_part(&digest, system->parameters, (size_t)model->parameter_count * sizeof *system->parameters);
    kmp_digest_end(&digest, name.choice.digest);
    kmp_cached file = kmp_program_cache_recall(system, name);
    kmp_byte_source source = kmp_byte_source_of(file.bytes, file.size);
    KMP_BYTES_TAKE(&source, loads, model->wheel_count);
    bool recalled = file.whole && !source.failed && source.at == source.end;
    kmp_free(file.whole);
    kempe_status status = recalled ? KEMPE_OK : find(system, loads);
    if (!recalled && status == KEMPE_OK) {
        kmp_bytes bytes = {0};
        KMP_BYTES_PUT(&bytes, loads, model->wheel_count);
        kmp_program_cache_write(system, name, &bytes);
        kmp_bytes_free(&bytes);
    }
    return status;
}

/* -- as a judge of runs ------------------------------------------------------------------------------- */

static kempe_status prepare(const kempe_system *system, const kempe_run_options *run, kmp_arena *arena, void **before)
{
    double *loads = NULL;
    *before = NULL;
    if (system->model->wheel_count == 0 || !run->judge_safety)
        return KEMPE_OK;
    *before = loads = KMP_ARENA_NEW(arena, double, system->model->wheel_count);
    KMP_TRY(kmp_made(system->context, loads));
    return take_static_loads(system, loads);
}

/* A wheel that has a load and loses it. */
static kempe_status loses_contact(const kempe_system *system, const kmp_samples *rows, bool *lost)
{
    kmp_output_program observed = {.system = system};
    kmp_text words = {0};
    const int wheels = system->model->wheel_count;
    for (int w = 0; w < wheels; w++)
        kmp_text_printf(&words, "%sguidance(%s).Q", w > 0 ? "," : "", system->model->wheels[w].name);
    kempe_status status =
        words.failed ? kmp_fail_memory(system->context) : kmp_output_program_init(&observed, system, words.s, 0, NULL);
    double *value = KMP_NEW(double, 2 * observed.columns.count + 1), *before = value + observed.columns.count;
    if (status == KEMPE_OK)
        status = kmp_made(system->context, value);
    for (int row = 0; status == KEMPE_OK && row < rows->rows && !*lost; row++) {
        kmp_output_program_fill(&observed, rows, row, value);
        for (int k = 1; k <= wheels && row > 0; k++)
            *lost = *lost || (before[k] > 0 && !(value[k] > 0));
        memcpy(before, value, (size_t)observed.columns.count * sizeof *before);
    }
    kmp_free(value);
    kmp_text_free(&words);
    kmp_output_program_free(&observed);
    return status;
}

const kmp_run_judge kmp_safety_judge = {prepare, judge_run, loses_contact, show_verdict, json_verdict};
