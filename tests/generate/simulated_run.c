/* SPDX-License-Identifier: BSD-3-Clause */
/* A program with a generated simulator, which needs nothing of Kempe:
 *
 *     kempe generate examples/four_bar/four_bar.yaml --lang c --simulator -o folder
 *     cc -std=c99 -Ifolder -DMODEL=four_bar -DMODEL_HEADER='"four_bar_simulator.h"' simulated_run.c folder/four_bar.c
 *        folder/four_bar_simulator.c folder/kempe_simulator.c -lm
 *     ./a.out 5 1e-9 7
 *
 * It runs to 5 s with a relative tolerance of 1e-9, in 7 parts, and prints time, coordinates, rates, accelerations,
 * multipliers and outputs; to stderr the largest difference of slopes from these accelerations and
 * rates, the work and, at a failure, the reason. With the further argument "exchange" it saves its state
 * after every second part, and another simulator goes on from there; NAME=VALUE sets a parameter. With "table" it
 * prints the names of the columns, and a row at the start and after each part, separated by commas. */
#include MODEL_HEADER
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define JOIN(a, b)     a##b
#define IN(name, part) JOIN(name, part)

static double memory[2][IN(MODEL, _memory)], saved[IN(MODEL, _memory)];

static void show(int count, const double *x)
{
    for (int k = 0; k < count; k++)
        printf(" %.17g", x[k]);
}

static void show_place(const kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    printf("%.17g", s->t);
    show(e->coordinates, s->q);
    show(e->coordinates, s->qd);
    show(e->coordinates, s->qdd);
    show(e->rows, s->lambda);
    show(e->outputs, s->y);
    printf("\n");
}

/* The largest relative difference of the slopes for each choice from the accelerations and rates, which are solved for.
 */
static double slopes_off(const kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    const double *qd = s->part.inner_qd, *qdd = s->part.inner_qdd;
    const kempe_arguments at = {s->t,      s->part.k,     s->part.inner_q, qd,           qdd,
                                s->lambda, s->part.modes, s->part.held,    s->part.chart};
    const int r = e->coordinates - e->freedom;
    static double udd[IN(MODEL, _memory)], vd[IN(MODEL, _memory)];
    double most = 0, checks[2], size = 0, turned = 0; /* the orientation from which angles count */
    for (int k = 0; e->charts && k < 9 * e->charts->joints; k++)
        turned = fmax(turned, fabs(s->part.chart[k] - (k % 9 % 4 == 0)));
    for (int k = 0; k < e->coordinates; k++)
        size = fmax(size, fmax(fabs(qdd[k]), fabs(qd[k])));
    for (int k = 0; s->part.rank == r && turned == 0 && k < e->slopes_count; k++) { /* none with rows that are held */
        e->slopes[k].evaluate(&at, udd, vd, checks);
        if (!(checks[0] > 0 && checks[1] <= 1))
            continue;
        for (int i = 0; i < e->freedom; i++)
            most = fmax(most, fabs(udd[i] - qdd[e->slopes[k].independent[i]]));
        for (int i = 0; i < r; i++)
            most = fmax(most, fabs(vd[i] - qd[e->slopes[k].dependent[i]]));
    }
    return size > 0 ? most / size : most;
}

static void set(kempe_simulator *s, const char *word)
{
    const size_t length = strcspn(word, "=");
    for (int k = 0; word[length] && k < s->equations->parameters; k++)
        if (strlen(s->equations->parameter_names[k]) == length &&
            strncmp(s->equations->parameter_names[k], word, length) == 0)
            s->p[k] = atof(word + length + 1);
    kempe_simulator_set_parameters(s);
}

static void put_names(const char *start, int count, const char *const *names)
{
    for (int k = 0; k < count; k++)
        printf(",%s%s", start, names[k]);
}

static void put_values(int count, const double *x)
{
    for (int k = 0; k < count; k++)
        printf(",%.17g", x[k]);
}

static void put_head(const kempe_equations *e)
{
    printf("t");
    put_names("q.", e->coordinates, e->coordinate_names);
    put_names("qd.", e->coordinates, e->coordinate_names);
    put_names("qdd.", e->coordinates, e->coordinate_names);
    put_names("lambda.", e->rows, e->row_names);
    put_names("", e->outputs, e->output_names);
    printf("\n");
}

static void put_row(const kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    printf("%.17g", s->t);
    put_values(e->coordinates, s->q);
    put_values(e->coordinates, s->qd);
    put_values(e->coordinates, s->qdd);
    put_values(e->rows, s->lambda);
    put_values(e->outputs, s->y);
    printf("\n");
}

int main(int argc, char **argv)
{
    const kempe_equations *e = &IN(MODEL, _equations);
    const double end = atof(argv[1]), tolerance = atof(argv[2]);
    const int parts = atoi(argv[3]), exchange = argc > 4 && strcmp(argv[4], "exchange") == 0;
    const int table = argc > 4 && strcmp(argv[4], "table") == 0;
    kempe_simulator s[2];
    if (kempe_simulator_memory(e) != IN(MODEL, _memory))
        return 2;
    for (int k = 0; k < 2; k++) {
        kempe_simulator_init(&s[k], e, memory[k]);
        s[k].settings.rtol = s[k].settings.atol = tolerance;
        for (int i = 4; i < argc; i++)
            set(&s[k], argv[i]);
    }
    kempe_simulator_status status = kempe_simulator_start(&s[0], 0);
    const clock_t begin = clock();
    int at = 0;
    if (table) {
        put_head(e);
        put_row(&s[0]);
    }
    for (int k = 1; k <= parts && status == KEMPE_SIMULATOR_GOES; k++) {
        status = kempe_simulator_advance(&s[at], k < parts ? end * k / parts : end);
        if (table && status == KEMPE_SIMULATOR_GOES)
            put_row(&s[at]);
        if (exchange && k % 2 == 0) {
            kempe_simulator_save(&s[at], saved);
            at = !at;
            kempe_simulator_restore(&s[at], saved);
        }
    }
    const double seconds = (double)(clock() - begin) / (double)CLOCKS_PER_SEC;
    if (!table)
        show_place(&s[at]);
    fprintf(stderr, "%d slopes, %.3g off\n", e->slopes_count, slopes_off(&s[at]));
    fprintf(stderr, "%.0f steps, %.0f evaluations, %.0f exchanges, %.0f events, %.7f s\n%s\n", s[at].work.steps,
            s[at].work.evaluations, s[at].work.exchanges, s[at].work.events, seconds, s[at].message);
    return status == KEMPE_SIMULATOR_FAILED;
}
