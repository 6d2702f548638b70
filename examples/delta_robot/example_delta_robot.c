/* SPDX-License-Identifier: BSD-3-Clause */
/* A delta robot under a controller of 1 kHz: the platform follows a circle that tilts. The controller is a proportional
 * and derivative law in the joints with the motors' share of the weight; the simulated time advances by 1 ms in one
 * fixed step of the integrator. Prints the error of the platform and the distribution of the time for a step.
 *
 *     example_delta_robot examples/delta_robot/delta_robot.yaml [seconds [picture.svg]]
 */
#include <kempe/settings.h>
#include <kempe/stepper.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define TURN (8 * atan(1.0))

static const double base = 0.2, platform = 0.06, arm = 0.3, rod = 0.7; /* as in the model */
static const double period = 0.5, sample = 1e-3;

enum { ARMS = 3, SHOWN = 2000 };

typedef struct robot {
    kempe_stepper *stepper;
    int input[ARMS], joint[ARMS], place[3]; /* inputs; coordinates of arms and platform */
} robot;

/* The path: a circle of 0.15 m, tilted, entered smoothly from its centre within a period. */
static void path(double t, double p[3])
{
    double s = fmin(t / period, 1), grown = s * s * s * (10 + s * (6 * s - 15)), angle = TURN * t / period;
    p[0] = 0.15 * grown * cos(angle);
    p[1] = 0.15 * grown * sin(angle);
    p[2] = -0.6 + 0.05 * grown * sin(angle);
}

/* Angle of an arm for a place of the platform: its end is at the distance of a rod from the platform's point, on the
 * outer side. */
static double angle_of(int k, const double p[3])
{
    double c = cos(k * TURN / 3), s = sin(k * TURN / 3);
    double u = p[0] * c + p[1] * s + platform - base, v = p[1] * c - p[0] * s, w = -p[2];
    double cosine = (u * u + v * v + w * w + arm * arm - rod * rod) / (2 * arm);
    return atan2(w, u) - acos(cosine / hypot(u, w));
}

static void reference(int k, double t, double *q, double *qd)
{
    const double h = 1e-4;
    double before[3], here[3], after[3];
    path(t - h, before);
    path(t, here);
    path(t + h, after);
    *q = angle_of(k, here);
    *qd = (angle_of(k, after) - angle_of(k, before)) / (2 * h);
}

/* Torques of the motors for the next sample. */
static kempe_status control(const robot *r, double t)
{
    const double stiffness = 2500, damping = 40, weight = -1.6;
    kempe_status status = KEMPE_OK;
    for (int k = 0; k < ARMS && status == KEMPE_OK; k++) {
        double q, qd;
        reference(k, t, &q, &qd);
        double error = q - kempe_stepper_q(r->stepper)[r->joint[k]];
        double rate = qd - kempe_stepper_qd(r->stepper)[r->joint[k]];
        status = kempe_stepper_set_input(r->stepper, r->input[k], stiffness * error + damping * rate + weight);
    }
    return status;
}

static double now(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double error_of(const robot *r, double t)
{
    double p[3], sum = 0;
    path(t, p);
    for (int i = 0; i < 3; i++) {
        double off = kempe_stepper_q(r->stepper)[r->place[i]] - p[i];
        sum += off * off;
    }
    return sqrt(sum);
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* -- picture ----------------------------------------------------------------------------------------- */

/* Path of the platform from above, and its error over time. */
static int draw(const char *name, int count, const double (*shown)[4])
{
    FILE *file = fopen(name, "w");
    if (!file)
        return 1;
    double most = 1e-6;
    for (int k = 0; k < count; k++)
        most = fmax(most, shown[k][3]);
    (void)fputs("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 640 300\" font-family=\"sans-serif\" "
                "font-size=\"12\">\n<rect width=\"640\" height=\"300\" fill=\"#fff\"/>\n",
                file);
    (void)fputs("<polyline fill=\"none\" stroke=\"#36c\" stroke-width=\"1.5\" points=\"", file);
    for (int k = 0; k < count; k++)
        (void)fprintf(file, "%.1f,%.1f ", 150 + 700 * shown[k][1], 160 - 700 * shown[k][2]);
    (void)fputs("\"/>\n<polyline fill=\"none\" stroke=\"#c33\" stroke-width=\"1.2\" points=\"", file);
    for (int k = 0; k < count; k++)
        (void)fprintf(file, "%.1f,%.1f ", 330 + 290 * k / (double)count, 260 - 200 * shown[k][3] / most);
    (void)fprintf(file,
                  "\"/>\n<line x1=\"330\" y1=\"260\" x2=\"620\" y2=\"260\" stroke=\"#888\"/>\n"
                  "<text x=\"60\" y=\"24\">path of the platform from above (m: 0.15)</text>\n"
                  "<text x=\"330\" y=\"24\">error of the platform, largest %.2f mm</text>\n"
                  "<text x=\"560\" y=\"278\">t = %.2f s</text>\n</svg>\n",
                  1e3 * most, count * sample);
    return fclose(file) != 0;
}

/* -- run --------------------------------------------------------------------------------------------- */

static int run(robot *r, int steps, const char *picture)
{
    static double shown[SHOWN][4];
    double *cost = malloc((size_t)steps * sizeof *cost), most = 0, sum = 0;
    kempe_status status = cost ? KEMPE_OK : KEMPE_E_MEMORY;
    int count = 0;
    for (int k = 0; k < steps && status == KEMPE_OK; k++) {
        double t = k * sample, begin = now();
        status = control(r, t);
        if (status == KEMPE_OK)
            status = kempe_stepper_advance(r->stepper, (k + 1) * sample);
        cost[k] = now() - begin;
        double error = error_of(r, kempe_stepper_time(r->stepper));
        most = fmax(most, error);
        sum += error * error;
        if (count < SHOWN) {
            const double row[4] = {t, kempe_stepper_q(r->stepper)[r->place[0]],
                                   kempe_stepper_q(r->stepper)[r->place[1]], error};
            memcpy(shown[count++], row, sizeof row);
        }
    }
    if (status == KEMPE_OK) {
        qsort(cost, (size_t)steps, sizeof *cost, by_size);
        printf("%d steps of 1 ms: error of the platform %.2f mm rms, %.2f mm at most\n", steps, 1e3 * sqrt(sum / steps),
               1e3 * most);
        printf("time for a step, controller included: median %.1f us, 99.9 %% %.1f us, longest %.1f us\n",
               1e6 * cost[steps / 2], 1e6 * cost[steps - 1 - steps / 1000], 1e6 * cost[steps - 1]);
        if (most > 5e-3) {
            fprintf(stderr, "the platform leaves its path by %g mm\n", 1e3 * most);
            status = KEMPE_E_FAILED;
        }
        status = status != KEMPE_OK                                           ? status
                 : picture && draw(picture, count, (const double(*)[4])shown) ? KEMPE_E_IO
                                                                              : KEMPE_OK;
    }
    free(cost);
    return status != KEMPE_OK;
}

static int find(const kempe_model *model, const char *name)
{
    for (int k = 0; k < kempe_model_coordinate_count(model); k++)
        if (strcmp(kempe_model_coordinate_name(model, k), name) == 0)
            return k;
    return 0;
}

static void find_all(robot *r, const kempe_model *model)
{
    char name[16];
    for (int k = 0; k < ARMS; k++) {
        (void)snprintf(name, sizeof name, "tau%d", k + 1);
        r->input[k] = kempe_model_input_find(model, name);
        (void)snprintf(name, sizeof name, "A%d", k + 1);
        r->joint[k] = find(model, name);
        (void)snprintf(name, sizeof name, "P.%d", k + 1);
        r->place[k] = find(model, name);
    }
}

int main(int count, char **word)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    robot r = {0};
    double seconds = count > 2 ? atof(word[2]) : 10;
    kempe_run_options options = {.size = sizeof options,
                                 .formulation = "projected",
                                 .integrator = "dopri5",
                                 .change_points = "ignore",
                                 .fixed_step = sample,
                                 .rtol = 1e-6,
                                 .t_end = seconds + 1};
    int bad = count < 2 || !context || kempe_model_read(context, word[1], &model) != KEMPE_OK ||
              kempe_system_new(model, &system) != KEMPE_OK ||
              kempe_stepper_new(system, &options, &r.stepper) != KEMPE_OK;
    if (!bad) {
        find_all(&r, model);
        bad = run(&r, (int)(seconds / sample), count > 3 ? word[3] : NULL);
    }
    if (bad)
        fprintf(stderr, "%s\n",
                count < 2 ? "example_delta_robot MODEL [SECONDS [PICTURE]]" : kempe_context_message(context));
    kempe_stepper_free(r.stepper);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
    return bad;
}
