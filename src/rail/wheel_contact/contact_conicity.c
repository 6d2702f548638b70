/* SPDX-License-Identifier: BSD-3-Clause */
/* The equivalent conicity of a pair of wheels, from the rolling radii of a table of contacts. */
#include "rail/wheel_contact/contact_conicity.h"
#include "base/context.h"
#include "constraints/tolerances.h"
#include "model/data/model.h"
#include "model/language/nearest.h"
#include <kempe/rolling_contact.h>
#include <kempe/vehicle.h>
#include <math.h>
#include <string.h>

/* -- Klingel's formula ----------------------------------------------------------------------------------- */

/* Equivalent conicity by integration of the kinematic motion (EN 15302, UIC 519). A wheelset that rolls without slip
 * obeys y'' = -d(y) / (e r0), where d is the difference of the rolling radii, e the distance of the contacts, r0 the
 * radius. The cone of the same wavelength L has the slope (2 pi / L)^2 e r0 / 2 (Klingel). With lengths along the track
 * in units of sqrt(e r0) both e and r0 cancel.
 *
 * d is linear between its points. Then the motion from one point to the next is harmonic, hyperbolic or of constant
 * acceleration, and its length is known in closed form, also at the ends, where the lateral velocity is zero:
 *
 *     v^2 = 2 (S(end) - S(y)),  S' = d,        w = (y1 - y0) / (v0 + v1),  k = (d1 - d0) / (y1 - y0),
 *     length = 2 w atan(w sqrt k) / (w sqrt k),  or with atanh and -k if k < 0.
 *
 * The motion of amplitude a is between the ends u - 2a and u of equal S with S below inside. Such an interval is found
 * by moving it over the table: S(u) - S(u - 2a) is a parabola between two points. */

/* A smaller difference of radii, m, is rounding: cylinders do not oscillate. */
#define EQUAL_RADII 1e-9

static const double pi = 3.14159265358979323846;

typedef struct radii_curve {
    int count;
    const double *y, *d;
} radii_curve;

/* A place in the curve: its piece, and the place itself. */
typedef struct curve_place {
    int piece;
    double y;
} curve_place;

static double slope_of(const radii_curve *c, int piece)
{
    return (c->d[piece + 1] - c->d[piece]) / (c->y[piece + 1] - c->y[piece]);
}

static double value_at(const radii_curve *c, const curve_place *p)
{
    return c->d[p->piece] + slope_of(c, p->piece) * (p->y - c->y[p->piece]);
}

/* Goes forwards within the piece, or to its end, where the next one begins. */
static void go(const radii_curve *c, curve_place *p, double step)
{
    p->y += step;
    if (c->y[p->piece + 1] - p->y <= 1e-12 * step) {
        p->y = c->y[p->piece + 1];
        p->piece += p->piece + 2 < c->count;
    }
}

/* The integral of d over `step` from a place in its piece. */
static double integral(const radii_curve *c, const curve_place *p, double step)
{
    return step * (value_at(c, p) + 0.5 * step * slope_of(c, p->piece));
}

static double rest_of(const radii_curve *c, const curve_place *p)
{
    return c->y[p->piece + 1] - p->y;
}

/* -- from one end to the other ------------------------------------------------------------------------------- */

/* The length between two points of a piece, with the squares of the velocities there; infinite: never. */
static double length_of(double step, double slope, double before, double after)
{
    double sum = sqrt(fmax(before, 0)) + sqrt(fmax(after, 0)), w = step / sum, z = slope * w * w, root = sqrt(fabs(z));
    if (sum == 0 || (z < 0 && root >= 1))
        return INFINITY;
    double factor = root < 1e-6 ? 1 - z / 3 : z > 0 ? atan(root) / root : atanh(root) / root;
    return 2 * w * factor;
}

/* The way to the next point or to `high`; to the place of equal radii inside, where the velocity is greatest. */
static double step_of(const radii_curve *c, const curve_place *p, double high)
{
    double step = fmin(rest_of(c, p), high - p->y), equal = -value_at(c, p) / slope_of(c, p->piece);
    bool inside = equal > 1e-9 * step && equal < (1 - 1e-9) * step && p->y + equal > p->y;
    return inside ? equal : step;
}

/* The length of the motion from `low` to `high`, in units of sqrt(e r0). False: it does not come through. */
static bool pass(const radii_curve *c, curve_place at, double high, double *length)
{
    double square = 0, least = -2 * EQUAL_RADII * (high - at.y);
    *length = 0;
    while (high - at.y > 1e-12 * (high - c->y[0])) {
        double step = step_of(c, &at, high);
        bool last = at.y + step >= high - 1e-12 * (high - c->y[0]);
        double after = last ? 0 : square - 2 * integral(c, &at, step), slope = slope_of(c, at.piece);
        if (after < least)
            return false;
        *length += length_of(step, slope, square, after);
        square = fmax(after, 0);
        go(c, &at, step);
    }
    return true;
}

/* -- the ends ------------------------------------------------------------------------------------------------- */

/* An interval of the amplitude that is moved over the curve: its ends, and the integral of d between them. */
typedef struct interval {
    curve_place low, high;
    double sum;
} interval;

/* Candidates in sequence: the sum rises through zero, or is zero for a while, and the middle of that is taken. */
typedef struct search {
    const radii_curve *c;
    double amplitude, small;
    double flat[2]; /* where the lower end began to have no sum, and last had none; NaN */
    bool below;     /* the sum was negative before */
    kempe_conicity *best;
    bool found;
} search;

static void try_at(search *s, double low)
{
    curve_place begin = {0, low};
    while (begin.piece + 2 < s->c->count && s->c->y[begin.piece + 1] <= low)
        begin.piece++;
    double length, high = fmin(low + 2 * s->amplitude, s->c->y[s->c->count - 1]), middle = low + s->amplitude;
    bool nearer = !s->found || fabs(middle) < fabs(0.5 * (s->best->low + s->best->high));
    if (!nearer || !pass(s->c, begin, high, &length))
        return;
    *s->best = (kempe_conicity){.conicity = 0.5 * (pi / length) * (pi / length), .low = low, .high = high};
    s->found = true;
}

static void note(search *s, const interval *i)
{
    if (i->sum < -s->small) {
        s->below = true;
        s->flat[0] = NAN;
    } else if (i->sum <= s->small) {
        s->flat[0] = isnan(s->flat[0]) ? i->low.y : s->flat[0];
        s->flat[1] = i->low.y;
    }
}

/* Takes the interval a step on. */
static void advance(search *s, interval *i, double step)
{
    interval before = *i;
    double b = value_at(s->c, &i->high) - value_at(s->c, &i->low);
    double k = slope_of(s->c, i->high.piece) - slope_of(s->c, i->low.piece);
    i->sum += integral(s->c, &i->high, step) - integral(s->c, &i->low, step);
    go(s->c, &i->low, step);
    go(s->c, &i->high, step);
    if (i->sum > s->small) {
        if (!isnan(s->flat[0]))
            try_at(s, 0.5 * (s->flat[0] + s->flat[1]));
        else if (s->below) {
            /* The first root of from + b h + k h^2 / 2 as it rises from below zero. */
            double from = before.sum, root = -2 * from / (b + sqrt(fmax(b * b - 2 * k * from, 0)));
            try_at(s, before.low.y + fmin(fmax(root, 0), step));
        }
        s->below = false;
        s->flat[0] = NAN;
    }
    note(s, i);
}

static bool find(const radii_curve *c, double amplitude, kempe_conicity *best)
{
    search s = {.c = c, .amplitude = amplitude, .small = 2 * EQUAL_RADII * amplitude, .flat = {NAN, NAN}, .best = best};
    interval i = {.low = {0, c->y[0]}, .high = {0, c->y[0]}};
    for (double last = fmin(c->y[0] + 2 * amplitude, c->y[c->count - 1]); i.high.y < last;) {
        double step = fmin(rest_of(c, &i.high), last - i.high.y);
        i.sum += integral(c, &i.high, step);
        go(c, &i.high, step);
    }
    note(&s, &i);
    for (double step; (step = fmin(rest_of(c, &i.low), rest_of(c, &i.high))) > 0;) /* to the next point at either end */
        advance(&s, &i, step);
    if (!isnan(s.flat[0]))
        try_at(&s, 0.5 * (s.flat[0] + s.flat[1]));
    return s.found;
}

kempe_status kempe_contact_conicity(int count, const double *y, const double *difference, double amplitude,
                                    kempe_conicity *conicity)
{
    KMP_WANTED(NULL, y, "y");
    KMP_WANTED(NULL, difference, "difference");
    KMP_WANTED(NULL, conicity, "conicity");
    const radii_curve c = {count, y, difference};
    kempe_conicity found;
    bool curve = count >= 2;
    for (int k = 0; k < count && curve; k++)
        curve = isfinite(y[k]) && isfinite(difference[k]) && (k == 0 || y[k] > y[k - 1]);
    if (!curve || !(amplitude > 0) || !isfinite(amplitude))
        return KEMPE_E_ARGUMENT;
    if (2 * amplitude > (y[count - 1] - y[0]) * (1 + 1e-12) || !find(&c, amplitude, &found))
        return KEMPE_E_FAILED;
    *conicity = found;
    return KEMPE_OK;
}

enum { USUAL_AMPLITUDES = 13, MOST_AMPLITUDES = 100000 };

/* Speed of a contact across its wheel, as a multiple of the wheel's: faster ones may jump. */
#define FAST 10

/* -- options ----------------------------------------------------------------------------------------------- */

static kempe_status take_amplitudes(kempe_contacts *t, const kmp_ranges *ranges)
{
    kempe_context *context = t->given->context;
    const kmp_range *r = ranges->range;
    if (ranges->count != 1)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "--conicity: one range of amplitudes is expected, as in '1 mm:7 mm:13'");
    KMP_TRY(kmp_range_fits(context, "--conicity", r, KMP_DIM_LENGTH));
    int count = r->from == r->to ? 1 : r->count > 0 ? r->count : USUAL_AMPLITUDES;
    if (!(fmin(r->from, r->to) > 0) || count > MOST_AMPLITUDES)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "--conicity: amplitudes are lengths above 0, at most %d, as in '1 mm:7 mm:13'",
                        MOST_AMPLITUDES);
    t->conicities.count = count;
    t->conicities.at = KMP_ARENA_NEW(&t->arena, kmp_conicity, count);
    KMP_TRY(kmp_made(context, t->conicities.at));
    for (int k = 0; k < count; k++)
        t->conicities.at[k].amplitude = kmp_range_value(r, k, count);
    return KEMPE_OK;
}

static kempe_status find_wheel(const kempe_model *model, const char *word, size_t length, int *wheel)
{
    kmp_text name = {0}, complaint = {0};
    kmp_text_printf(&name, "%.*s", (int)length, word);
    KMP_TRY(kmp_made(model->context, name.s != NULL));
    kmp_text_put(&complaint, "--pair: ");
    *wheel = kmp_word_find(name.s, KMP_NAMES(model->wheels, model->wheel_count), "wheel", &complaint);
    kmp_text_free(&name);
    if (*wheel == model->wheel_count)
        return kmp_fail_text(model->context, KEMPE_E_ARGUMENT, &complaint);
    kmp_text_free(&complaint);
    return KEMPE_OK;
}

static kempe_status read_pair(const kempe_model *model, const char *words, int wheel[2])
{
    const char *comma = strchr(words, ',');
    if (!comma || strchr(comma + 1, ','))
        return kmp_fail(model->context, KEMPE_E_ARGUMENT, "--pair: two wheels are expected, as in 'L,R'");
    KMP_TRY(find_wheel(model, words, (size_t)(comma - words), &wheel[0]));
    KMP_TRY(find_wheel(model, comma + 1, strlen(comma + 1), &wheel[1]));
    const kmp_wheel *left = &model->wheels[wheel[0]], *right = &model->wheels[wheel[1]];
    if (left->side != KMP_TRACK_LEFT || right->side != KMP_TRACK_RIGHT || left->track != right->track)
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "--pair: '%s' must be a wheel on the left rail of a track, and '%s' one on its right rail",
                        left->name, right->name);
    return KEMPE_OK;
}

/* The only wheel of a side; -1: there are none or several. */
static int only_wheel(const kempe_model *model, kmp_track_side side)
{
    int found = -1;
    for (int k = 0; k < model->wheel_count; k++) {
        if (model->wheels[k].side == side && found >= 0)
            return -1;
        found = model->wheels[k].side == side ? k : found;
    }
    return found;
}

static kempe_status find_pair(const kempe_model *model, int wheel[2])
{
    wheel[0] = only_wheel(model, KMP_TRACK_LEFT);
    wheel[1] = only_wheel(model, KMP_TRACK_RIGHT);
    if (wheel[0] < 0 || wheel[1] < 0 || model->wheels[wheel[0]].track != model->wheels[wheel[1]].track)
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "--conicity: the model does not have exactly one left and one right wheel on a track: name the "
                        "wheels of a wheelset by --pair LEFT,RIGHT");
    return KEMPE_OK;
}

kempe_status kmp_contact_conicity_request(kempe_contacts *t, const kempe_contact_options *options)
{
    kmp_conicities *c = &t->conicities;
    c->nonlinearity = c->base = c->radius = NAN;
    if (!options->conicity || !*options->conicity)
        return options->pair
                   ? kmp_fail(t->given->context, KEMPE_E_ARGUMENT,
                              "--pair: the pair of wheels is for the equivalent conicity: give --conicity too")
                   : KEMPE_OK;
    const char *words = options->conicity;
    kmp_text text = {0};
    kmp_ranges ranges = {0};
    kmp_text_printf(&text, "amplitude=%s", words);
    kempe_status status = kmp_made(t->given->context, text.s != NULL);
    if (status == KEMPE_OK)
        status = kmp_ranges_read(t->given->context, text.s, &ranges);
    if (status == KEMPE_OK)
        status = take_amplitudes(t, &ranges);
    kmp_text_free(&text);
    kmp_ranges_free(&ranges);
    KMP_TRY(status);
    return options->pair ? read_pair(t->given->model, options->pair, c->wheel) : find_pair(t->given->model, c->wheel);
}

/* -- the difference of the rolling radii --------------------------------------------------------------------- */

/* The patches of the left and the right wheel that carry the most in a row. false: one of them does not touch. */
static bool pair_of(const kempe_contacts *t, const kempe_contact_patch *patches, const kempe_contact_patch *pair[2])
{
    for (int k = 0; k < 2; k++) {
        const int wheel = t->conicities.wheel[k];
        pair[k] = NULL;
        for (int z = t->first[wheel]; z < t->first[wheel + 1]; z++)
            if (patches[z].touches && (!pair[k] || patches[z].normal > pair[k]->normal))
                pair[k] = &patches[z];
    }
    return pair[0] && pair[1];
}

static const kempe_contact_patch *patches_of(const kempe_contacts *t, int row)
{
    return t->patch + (ptrdiff_t)row * t->first[t->wheel_count];
}

bool kmp_contact_may_jump(const kempe_contacts *t)
{
    const kempe_contact_patch *before[2], *after[2];
    int row = t->count - 1;
    if (row < 1 || !pair_of(t, patches_of(t, row - 1), before) || !pair_of(t, patches_of(t, row), after))
        return false;
    double far = FAST * fabs(t->conicities.row[row].aside - t->conicities.row[row - 1].aside);
    return fabs(after[0]->s - before[0]->s) > far || fabs(after[1]->s - before[1]->s) > far;
}

kmp_displaced kmp_contact_displaced(const kempe_contacts *t, const kempe_contact_patch *patches, const double *poses)
{
    const kempe_contact_patch *pair[2];
    double outwards[2];
    for (int k = 0; k < 2; k++) {
        int wheel = t->conicities.wheel[k];
        const double *pose = poses + (ptrdiff_t)KMP_POSE_SHOWN * wheel;
        outwards[k] = pose[0] + t->system->model->wheels[wheel].radius.value * pose[4];
    }
    bool both = pair_of(t, patches, pair);
    return (kmp_displaced){(outwards[0] - outwards[1]) / 2, both ? pair[0]->radius - pair[1]->radius : NAN};
}

/* The longest sequence of rows in which both wheels touch. */
static int longest(const kempe_contacts *t, int *first)
{
    int most = 0;
    *first = 0;
    for (int row = 0, begin = 0; row < t->count; row++) {
        begin = isnan(t->conicities.row[row].difference) ? row + 1 : begin;
        if (row + 1 - begin > most) {
            most = row + 1 - begin;
            *first = begin;
        }
    }
    return most;
}

/* The rows of the table in which both wheels touch, in the order of ascending displacements. */
typedef struct course {
    int first, count, step; /* rows first, first + step, .. */
} course;

static int row_of(const course *rows, int k)
{
    return rows->first + k * rows->step;
}

/* A curve of differences over displacements that ascend. */
typedef struct curve {
    int count;
    double *y, *difference;
} curve;

static void add(curve *c, const kmp_displaced *place)
{
    c->y[c->count] = place->aside;
    c->difference[c->count++] = place->difference;
}

/* Adds the points between a row of the course and the next one; a point that does not ascend, by rounding, is left out.
 */
static void add_between(const kempe_contacts *t, const course *rows, int k, curve *c)
{
    const kmp_conicity_points *b = &t->conicities.between[rows->step > 0 ? row_of(rows, k) : row_of(rows, k + 1)];
    double before = t->conicities.row[row_of(rows, k)].aside, after = t->conicities.row[row_of(rows, k + 1)].aside;
    for (int i = 0; i < b->count; i++) {
        const kmp_displaced *place = &b->at[rows->step > 0 ? i : b->count - 1 - i];
        if (place->aside > before && place->aside < after) {
            add(c, place);
            before = place->aside;
        }
    }
}

/* Fills the curve from rows at a stride, the last one, and the points between rows. */
static void gather(const kempe_contacts *t, const course *rows, int every, curve *c)
{
    for (int k = 0; k < rows->count; k++) {
        bool last = k == rows->count - 1;
        if (k % every == 0 || last)
            add(c, &t->conicities.row[row_of(rows, k)]);
        if (!last)
            add_between(t, rows, k, c);
    }
}

static kempe_status find_course(kempe_contacts *t, course *rows)
{
    const kmp_displaced *at = t->conicities.row;
    int first, count = longest(t, &first), last = first + count - 1;
    if (count < 2)
        return KEMPE_OK;
    *rows = (course){.first = first, .count = count, .step = 1};
    if (at[last].aside < at[first].aside)
        *rows = (course){.first = last, .count = count, .step = -1};
    for (int k = 0; k + 1 < count; k++) {
        int row = row_of(rows, k), next = row_of(rows, k + 1);
        if (!(at[next].aside > at[row].aside))
            return kmp_fail(
                t->given->context, KEMPE_E_ARGUMENT,
                "--conicity: '%s' must move both wheels laterally, always in one direction; at %.6g and %.6g "
                "they are %.6g and %.6g mm to the left of the middle of the track",
                t->over.range[0].name, t->value[row], t->value[next], at[row].aside * 1e3, at[next].aside * 1e3);
    }
    return KEMPE_OK;
}

/* -- conicities ------------------------------------------------------------------------------------------- */

static kempe_conicity conicity_of(const curve *c, double amplitude)
{
    kempe_conicity found = {NAN, NAN, NAN};
    if (c->count >= 2)
        (void)kempe_contact_conicity(c->count, c->y, c->difference, amplitude, &found);
    return found;
}

/* A conicity that every second value changes much, or an amplitude that spans few values: with three of them that are
 * symmetric, half of them give the same. */
static void doubt_conicities(const kempe_contacts *t, int values)
{
    const kmp_conicities *c = &t->conicities;
    const double step = c->points > 1 && values > 1 ? (c->y[c->points - 1] - c->y[0]) / (values - 1) : INFINITY;
    for (int k = 0; k < c->count; k++) {
        const kmp_conicity *at = &c->at[k];
        if (isnan(at->conicity) || (at->error <= KMP_CONICITY_RESOLVED * fmax(at->conicity, KMP_CONICITY_SMALL) &&
                                    at->amplitude >= KMP_CONICITY_STEPS * step))
            continue;
        kmp_doubt(t->given->context,
                  "the conicity at the amplitude of %.4g mm is not resolved by values %.3g mm apart: without every "
                  "second one it changes by %.2g; take more values of the sweep",
                  1e3 * at->amplitude, 1e3 * step, at->error);
        return;
    }
}

kempe_status kmp_contact_conicity(kempe_contacts *t)
{
    kmp_conicities *c = &t->conicities;
    course rows = {0};
    curve whole = {0}, half = {0};
    KMP_TRY(find_course(t, &rows));
    /* The distance of the contacts where the wheels are nearest to the middle of the track, and the mean radius. */
    const kmp_wheel *wheels = t->system->model->wheels;
    const kempe_contact_patch *pair[2];
    double least = INFINITY;
    for (int row = 0; row < t->count; row++)
        if (pair_of(t, patches_of(t, row), pair) && fabs(c->row[row].aside) < least) {
            least = fabs(c->row[row].aside);
            c->base = pair[0]->y + pair[1]->y;
        }
    c->radius = (wheels[c->wheel[0]].radius.value + wheels[c->wheel[1]].radius.value) / 2;
    int most = rows.count;
    for (int row = 0; row < t->count; row++)
        most += c->between[row].count;
    KMP_TRY(kmp_made(t->given->context, KMP_ARENA_MAKE(&t->arena, KMP_ROOM(double, most, &whole.y, &whole.difference,
                                                                           &half.y, &half.difference))));
    gather(t, &rows, 1, &whole);
    gather(t, &rows, 2, &half);
    c->points = whole.count;
    c->y = whole.y;
    c->difference = whole.difference;
    for (int k = 0; k < c->count; k++) {
        double amplitude = c->at[k].amplitude;
        kempe_conicity found = conicity_of(&whole, amplitude);
        kempe_conicity coarse = conicity_of(&half, amplitude);
        c->at[k] =
            (kmp_conicity){.amplitude = amplitude,
                           .conicity = found.conicity,
                           .error = fabs(found.conicity - coarse.conicity),
                           .wavelength = 2 * 3.14159265358979323846 * sqrt(c->base * c->radius / (2 * found.conicity)),
                           .low = found.low,
                           .high = found.high};
    }
    doubt_conicities(t, rows.count);
    c->nonlinearity = (conicity_of(&whole, 4e-3).conicity - conicity_of(&whole, 2e-3).conicity) / (2 * 1e-3);
    return KEMPE_OK;
}
