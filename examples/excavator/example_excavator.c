/* SPDX-License-Identifier: BSD-3-Clause */
/* The bucket of an excavator levels the ground: its tooth moves back and forth on a horizontal line while the bucket
 * keeps its attitude. A controller of 1 kHz sets the pressures of three hydraulic cylinders. The closed-chain Jacobian
 * turns the wanted velocity of the bucket into strokes; a proportional and integral law in the rates of the strokes
 * follows. Prints the error of the tooth and the distribution of the time for a sample.
 *
 *     example_excavator examples/excavator/excavator.yaml [seconds [picture.svg]]
 */
#include <kempe/output_handles.h>
#include <kempe/settings.h>
#include <kempe/stepper.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { CYLINDERS = 3, SHOWN = 400, PLACES = 14 };

static const double sample = 1e-3, period = 8, reach = 1;

/* Of each cylinder: piston area (m2), static pressure at the start (Pa), gains of the rate (N s/m) and the stroke
 * (N/m).
 */
static const struct {
    const char *stroke, *input;
    double area, hold, rate, place;
} cylinder[CYLINDERS] = {{"boom_stroke", "boom_pressure", 50e-4, 45.5e5, 5e5, 5e6},
                         {"stick_stroke", "stick_pressure", 50e-4, -4.9e5, 1e5, 1e6},
                         {"bucket_stroke", "bucket_pressure", 30e-4, 1.7e5, 3e4, 3e5}};

typedef struct excavator {
    kempe_stepper *stepper;
    kempe_outputs *bucket, *places;                            /* what is controlled; what is drawn */
    int input[CYLINDERS], stroke[CYLINDERS], order[CYLINDERS]; /* order: column of the Jacobian */
    double start[CYLINDERS], behind[CYLINDERS]; /* the bucket at the start; strokes behind the wanted ones */
} excavator;

/* The bucket at t, and its velocity: tooth in x and y, stick's tip in y. */
static void path(const excavator *e, double t, double p[CYLINDERS], double v[CYLINDERS])
{
    const double w = 8 * atan(1.0) / period;
    memcpy(p, e->start, CYLINDERS * sizeof *p);
    memset(v, 0, CYLINDERS * sizeof *v);
    p[0] -= 0.5 * reach * (1 - cos(w * t));
    v[0] = -0.5 * reach * w * sin(w * t);
}

static double determinant(const double *a, const double *b, const double *c)
{
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1]) + c[0] * (a[1] * b[2] - a[2] * b[1]);
}

/* Rates of the strokes for a velocity of the bucket, by Cramer's rule. */
static kempe_status rates_of(excavator *e, double t, const double v[CYLINDERS], double rate[CYLINDERS])
{
    double jacobian[CYLINDERS * CYLINDERS];
    kempe_status status =
        kempe_outputs_closed_jacobian(e->bucket, t, kempe_stepper_q(e->stepper), NULL, jacobian, NULL);
    const double *column[CYLINDERS];
    for (int k = 0; k < CYLINDERS; k++)
        column[k] = jacobian + (ptrdiff_t)CYLINDERS * e->order[k];
    double whole = determinant(column[0], column[1], column[2]);
    rate[0] = determinant(v, column[1], column[2]) / whole;
    rate[1] = determinant(column[0], v, column[2]) / whole;
    rate[2] = determinant(column[0], column[1], v) / whole;
    return status;
}

/* Pressures for the next sample. */
static kempe_status control(excavator *e, double t)
{
    const double pull = 5; /* 1/s: how fast an error of the path is to vanish */
    double p[CYLINDERS], v[CYLINDERS], here[CYLINDERS], rate[CYLINDERS];
    path(e, t, p, v);
    kempe_status status = kempe_outputs_at_stepper(e->bucket, e->stepper, here);
    for (int k = 0; k < CYLINDERS; k++)
        v[k] += pull * (p[k] - here[k]);
    if (status == KEMPE_OK)
        status = rates_of(e, t, v, rate);
    for (int k = 0; k < CYLINDERS && status == KEMPE_OK; k++) {
        double slow = rate[k] - kempe_stepper_qd(e->stepper)[e->stroke[k]];
        e->behind[k] += sample * slow;
        double force = cylinder[k].rate * slow + cylinder[k].place * e->behind[k];
        status = kempe_stepper_set_input(e->stepper, e->input[k], cylinder[k].hold + force / cylinder[k].area);
    }
    return status;
}

static double now(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* -- picture ----------------------------------------------------------------------------------------- */

/* The places that are drawn. */
static const char words[] =
    "position(ground.foot), position(ground.cylinder), position(boom.lug), position(boom.cylinder), "
    "position(boom.tip), "
    "position(stick.lug), position(stick.cylinder), position(stick.rocker), position(stick.tip), position(bucket.lug), "
    "position(bucket.tooth), position(boom_piston.eye), position(stick_piston.eye), position(bucket_piston.eye)";
enum { FOOT, BASE, BOOM_LUG, ON_BOOM, BOOM_TIP, STICK_LUG, ON_STICK, ROCKER, STICK_TIP, BUCKET_LUG, TOOTH, EYE };

/* Parts of the arm by their places: a plate through up to five, a bar between two. */
static const struct {
    int count, place[5];
} part[] = {{4, {FOOT, ON_BOOM, BOOM_TIP, BOOM_LUG}},
            {5, {BOOM_TIP, STICK_LUG, ON_STICK, STICK_TIP, ROCKER}},
            {3, {STICK_TIP, BUCKET_LUG, TOOTH}},
            {2, {ROCKER, EYE + 2}},
            {2, {EYE + 2, BUCKET_LUG}}};

/* Feet and lengths of the barrels. */
static const struct {
    int foot;
    double length;
} barrel[CYLINDERS] = {{BASE, 0.8}, {ON_BOOM, 0.9}, {ON_STICK, 0.7}};

static double right(const double *place)
{
    return 60 + 125 * place[0];
}

static double down(const double *place)
{
    return 215 - 125 * place[1];
}

static void draw_line(FILE *file, const char *colour, double width, const double *from, const double *to)
{
    (void)fprintf(file, "<line stroke=\"%s\" stroke-width=\"%g\" x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\"/>\n",
                  colour, width, right(from), down(from), right(to), down(to));
}

/* One pose: plates and bars, then the rods and barrels of the cylinders. */
static void draw_pose(FILE *file, double (*at)[3])
{
    for (size_t k = 0; k < sizeof part / sizeof *part; k++) {
        (void)fputs("<polygon fill=\"#c9dcec\" stroke=\"#369\" stroke-width=\"3\" stroke-linejoin=\"round\" points=\"",
                    file);
        for (int i = 0; i < part[k].count; i++)
            (void)fprintf(file, "%.1f,%.1f ", right(at[part[k].place[i]]), down(at[part[k].place[i]]));
        (void)fputs("\"/>\n", file);
    }
    for (int k = 0; k < CYLINDERS; k++) {
        const double *foot = at[barrel[k].foot], *eye = at[EYE + k];
        double part_of = barrel[k].length / hypot(eye[0] - foot[0], eye[1] - foot[1]);
        const double end[3] = {foot[0] + part_of * (eye[0] - foot[0]), foot[1] + part_of * (eye[1] - foot[1])};
        draw_line(file, "#7b8a96", 5, end, eye);
        draw_line(file, "#d4ac0d", 11, foot, end);
    }
}

/* The arm in four poses, and the way of its tooth. */
static int draw(const char *name, int count, double (*row)[PLACES][3])
{
    FILE *file = fopen(name, "w");
    if (!file)
        return 1;
    (void)fputs("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 560 400\">\n"
                "<rect width=\"560\" height=\"400\" fill=\"#fff\"/>\n",
                file);
    for (int pose = 3; pose >= 0; pose--) {
        (void)fprintf(file, "<g opacity=\"%g\">\n", pose ? 0.25 : 1);
        draw_pose(file, row[pose * (count - 1) / 6]);
        (void)fputs("</g>\n", file);
    }
    (void)fputs("<polyline fill=\"none\" stroke=\"#c33\" stroke-width=\"2\" points=\"", file);
    for (int k = 0; k < count; k++)
        (void)fprintf(file, "%.1f,%.1f ", right(row[k][TOOTH]), down(row[k][TOOTH]));
    (void)fputs("\"/>\n</svg>\n", file);
    return fclose(file) != 0;
}

/* -- run --------------------------------------------------------------------------------------------- */

static int report(double *cost, int steps, double most, double sum)
{
    qsort(cost, (size_t)steps, sizeof *cost, by_size);
    printf("%d samples of 1 ms: error of the tooth %.2f mm rms, %.2f mm at most\n", steps, 1e3 * sqrt(sum / steps),
           1e3 * most);
    printf("time for a sample, controller included: median %.1f us, 99.9 %% %.1f us, longest %.1f us\n",
           1e6 * cost[steps / 2], 1e6 * cost[steps - 1 - steps / 1000], 1e6 * cost[steps - 1]);
    return most > 5e-3;
}

static int run(excavator *e, int steps, const char *picture)
{
    static double shown[SHOWN][PLACES][3];
    double *cost = malloc((size_t)steps * sizeof *cost), most = 0, sum = 0;
    kempe_status status = cost ? kempe_outputs_at_stepper(e->bucket, e->stepper, e->start) : KEMPE_E_MEMORY;
    int count = 0;
    for (int k = 0; k < steps && status == KEMPE_OK; k++) {
        double begin = now(), p[CYLINDERS], v[CYLINDERS], here[CYLINDERS] = {0};
        status = control(e, k * sample);
        if (status == KEMPE_OK)
            status = kempe_stepper_advance(e->stepper, (k + 1) * sample);
        cost[k] = now() - begin;
        if (status == KEMPE_OK)
            status = kempe_outputs_at_stepper(e->bucket, e->stepper, here);
        path(e, (k + 1) * sample, p, v);
        double error = hypot(here[0] - p[0], here[1] - p[1]);
        most = fmax(most, error);
        sum += error * error;
        if (count < SHOWN && k * (double)SHOWN >= count * (double)steps)
            status = status == KEMPE_OK ? kempe_outputs_at_stepper(e->places, e->stepper, shown[count++][0]) : status;
    }
    int bad = status != KEMPE_OK || report(cost, steps, most, sum) || (picture && draw(picture, count, shown));
    free(cost);
    return bad;
}

static int find(const kempe_model *model, const char *name)
{
    for (int k = 0; k < kempe_model_coordinate_count(model); k++)
        if (strcmp(kempe_model_coordinate_name(model, k), name) == 0)
            return k;
    return 0;
}

static kempe_status prepare(excavator *e, const kempe_model *model, const kempe_system *system)
{
    kempe_status status = kempe_outputs_new(
        system, "position(bucket.tooth).x, position(bucket.tooth).y, position(stick.tip).y", &e->bucket);
    if (status == KEMPE_OK)
        status = kempe_outputs_choose(e->bucket, "boom_stroke, stick_stroke, bucket_stroke");
    if (status == KEMPE_OK)
        status = kempe_outputs_new(system, words, &e->places);
    for (int k = 0; k < CYLINDERS && status == KEMPE_OK; k++) {
        e->input[k] = kempe_model_input_find(model, cylinder[k].input);
        e->stroke[k] = find(model, cylinder[k].stroke);
        for (int c = 0; c < CYLINDERS; c++)
            e->order[k] = kempe_outputs_independent(e->bucket)[c] == e->stroke[k] ? c : e->order[k];
    }
    return status;
}

int main(int count, char **word)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    excavator e = {0};
    double seconds = count > 2 ? atof(word[2]) : 8;
    kempe_run_options options = {.size = sizeof options, .rtol = 1e-8, .t_end = seconds + 1};
    int bad = count < 2 || !context || kempe_model_read(context, word[1], &model) != KEMPE_OK ||
              kempe_system_new(model, &system) != KEMPE_OK ||
              kempe_stepper_new(system, &options, &e.stepper) != KEMPE_OK || prepare(&e, model, system) != KEMPE_OK ||
              run(&e, (int)(seconds / sample), count > 3 ? word[3] : NULL);
    if (bad)
        fprintf(stderr, "%s\n",
                count < 2 ? "example_excavator MODEL [SECONDS [PICTURE]]" : kempe_context_message(context));
    kempe_outputs_free(e.bucket);
    kempe_outputs_free(e.places);
    kempe_stepper_free(e.stepper);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
    return bad;
}
