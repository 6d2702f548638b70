/* SPDX-License-Identifier: BSD-3-Clause */
/* Finds the four-bar whose coupler point goes through given places: nine dimensions and the angle at which the crank
 * begins, by least squares. NLopt searches; Kempe gives it the curve and its exact gradient.
 *
 *     example_coupler_fit [examples/coupler_fit/coupler_fit.yaml [picture.svg]]
 *
 * It fails unless the places are met to 1e-6 m, and unless the gradient agrees with differences.
 */
#include <kempe/gradient.h>
#include <kempe/kempe.h>
#include <math.h>
#include <nlopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { DIMENSIONS = 9, UNKNOWNS = DIMENSIONS + 1, MOST = 100 };

static const char *const names[UNKNOWNS] = {"crank",  "coupler", "rocker", "base", "along",
                                            "across", "x",       "y",      "tilt", "begin"};
static const double guess[UNKNOWNS] = {0.8, 2.2, 2.8, 2.2, 4.4, 0.4, 0.3, -0.2, 0.1, 1.3};
static const double least[UNKNOWNS] = {0.1, 0.1, 0.1, 0.1, -9, -9, -9, -9, -3, -3};
static const double most[UNKNOWNS] = {9, 9, 9, 9, 9, 9, 9, 9, 3, 6};

typedef struct fit {
    kempe_gradient *gradient;
    int count; /* places */
    double turned[MOST], x[MOST], y[MOST];
    long evaluations;
    double best, at[UNKNOWNS]; /* the best that has been met, in case the search ends elsewhere */
} fit;

/* Mean square distance of the coupler point from the places, and its gradient (NULL: not wanted). */
static double distance(unsigned n, const double *v, double *slope, void *user)
{
    fit *f = user;
    double sum = 0;
    f->evaluations++;
    for (unsigned i = 0; slope && i < n; i++)
        slope[i] = 0;
    if (kempe_gradient_set(f->gradient, v) != KEMPE_OK)
        return HUGE_VAL;
    for (int k = 0; k < f->count; k++) {
        double angle = v[DIMENSIONS] + f->turned[k];
        if (kempe_gradient_eval(f->gradient, &angle, NULL, NULL) != KEMPE_OK)
            return HUGE_VAL; /* no such linkage turns that far */
        const double *p = kempe_gradient_values(f->gradient), *by = kempe_gradient_jacobian(f->gradient);
        const double *by_angle = kempe_gradient_by_driven(f->gradient), off[2] = {p[0] - f->x[k], p[1] - f->y[k]};
        for (int c = 0; c < 2; c++) {
            sum += off[c] * off[c] / f->count;
            for (int i = 0; slope && i < DIMENSIONS; i++)
                slope[i] += 2 * off[c] * by[c * DIMENSIONS + i] / f->count;
            if (slope)
                slope[DIMENSIONS] += 2 * off[c] * by_angle[c] / f->count;
        }
    }
    if (sum < f->best) {
        f->best = sum;
        memcpy(f->at, v, sizeof f->at);
    }
    return sum;
}

/* The crank turns all the way round when it and any other bar are together shorter than the two that are left
 * (Grashof): at most zero, with a little room. */
static void grashof(unsigned m, double *out, unsigned n, const double *v, double *slope, void *user)
{
    (void)user;
    for (unsigned k = 0; k < m; k++) {
        out[k] = 0.02 + v[0];
        for (unsigned i = 1; i < 4; i++)
            out[k] += i == k + 1 ? v[i] : -v[i];
        for (unsigned i = 0; slope && i < n; i++)
            slope[k * n + i] = i > 3 ? 0 : i == 0 || i == k + 1 ? 1 : -1;
    }
}

/* The worst of the gradient against two-sided differences of the best step, in parts of its norm. */
static double check_gradient(fit *f, const double *v)
{
    double slope[UNKNOWNS], norm = 0, worst = 0;
    (void)distance(UNKNOWNS, v, slope, f);
    for (int i = 0; i < UNKNOWNS; i++)
        norm = hypot(norm, slope[i]);
    for (int i = 0; i < UNKNOWNS; i++) {
        double best = HUGE_VAL, step = 1e-3;
        for (int k = 0; k < 4; k++, step /= 10) {
            double up[UNKNOWNS], down[UNKNOWNS];
            memcpy(up, v, sizeof up);
            memcpy(down, v, sizeof down);
            up[i] += step;
            down[i] -= step;
            double difference = distance(UNKNOWNS, up, NULL, f) - distance(UNKNOWNS, down, NULL, f);
            best = fmin(best, fabs(difference / (2 * step) - slope[i]));
        }
        worst = fmax(worst, best / norm);
    }
    return worst;
}

static int read_places(fit *f, const char *model)
{
    char path[1024], line[256];
    const char *slash = strrchr(model, '/');
    snprintf(path, sizeof path, "%.*starget.csv", slash ? (int)(slash - model + 1) : 0, model);
    FILE *file = fopen(path, "r");
    while (file && f->count < MOST && fgets(line, sizeof line, file)) {
        double degrees;
        if (sscanf(line, "%lf,%lf,%lf", &degrees, &f->x[f->count], &f->y[f->count]) == 3)
            f->turned[f->count++] = degrees * acos(-1) / 180;
    }
    if (file)
        fclose(file);
    return f->count > 0;
}

/* -- the picture ------------------------------------------------------------------------------------- */

static double across(double x)
{
    return 150 + 80 * x;
}

static double up(double y)
{
    return 420 - 80 * y;
}

/* The whole curve of one set of dimensions, as a line. */
static void draw_curve(FILE *file, fit *f, const double *v, const char *style)
{
    fprintf(file, "<polyline fill=\"none\" %s points=\"", style);
    for (int k = 0; k <= 180 && kempe_gradient_set(f->gradient, v) == KEMPE_OK; k++) {
        double angle = v[DIMENSIONS] + k * acos(-1) / 90;
        if (kempe_gradient_eval(f->gradient, &angle, NULL, NULL) == KEMPE_OK)
            fprintf(file, "%.1f,%.1f ", across(kempe_gradient_values(f->gradient)[0]),
                    up(kempe_gradient_values(f->gradient)[1]));
    }
    fprintf(file, "\"/>\n");
}

/* The bars where the crank begins. */
static void draw_bars(FILE *file, fit *f, const double *v, const char *style)
{
    double x[6] = {v[6]}, y[6] = {v[7]};
    if (kempe_gradient_set(f->gradient, v) != KEMPE_OK ||
        kempe_gradient_eval(f->gradient, v + 9, NULL, NULL) != KEMPE_OK)
        return;
    const double *q = kempe_gradient_q(f->gradient);
    double coupler = q[0] + q[1], tilt = v[8];
    x[1] = x[0] + v[0] * cos(q[0]), y[1] = y[0] + v[0] * sin(q[0]);
    x[2] = kempe_gradient_values(f->gradient)[0], y[2] = kempe_gradient_values(f->gradient)[1];
    x[3] = x[1] + v[1] * cos(coupler), y[3] = y[1] + v[1] * sin(coupler);
    x[4] = x[1], y[4] = y[1];
    fprintf(file, "<polyline fill=\"none\" %s points=\"", style);
    for (int k = 0; k < 5; k++)
        fprintf(file, "%.1f,%.1f ", across(x[k]), up(y[k]));
    x[5] = x[0] + v[3] * cos(tilt), y[5] = y[0] + v[3] * sin(tilt);
    fprintf(file, "%.1f,%.1f %.1f,%.1f\"/>\n", across(x[3]), up(y[3]), across(x[5]), up(y[5]));
    for (int k = 0; k < 6; k += 5)
        fprintf(file, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"5\" fill=\"#5d6d7e\"/>\n", across(x[k]), up(y[k]));
}

static void draw(const char *path, fit *f, const double *found)
{
    FILE *file = fopen(path, "w");
    if (!file)
        return;
    fprintf(file, "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"560\" height=\"450\" font-family=\"sans-serif\" "
                  "font-size=\"13\">\n<title>a four-bar fitted to a coupler curve</title>\n"
                  "<rect width=\"560\" height=\"450\" fill=\"white\"/>\n");
    draw_curve(file, f, guess, "stroke=\"#a25602\" stroke-width=\"1.5\" stroke-dasharray=\"5 4\"");
    draw_curve(file, f, found, "stroke=\"#253c9f\" stroke-width=\"2\"");
    draw_bars(file, f, guess, "stroke=\"#a25602\" stroke-width=\"2\" stroke-opacity=\"0.4\"");
    draw_bars(file, f, found, "stroke=\"#253c9f\" stroke-width=\"3\" stroke-opacity=\"0.6\"");
    for (int k = 0; k < f->count; k++)
        fprintf(file, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3\" fill=\"#e90154\"/>\n", across(f->x[k]), up(f->y[k]));
    fprintf(file, "<text x=\"400\" y=\"230\" fill=\"#e90154\">places to go through</text>\n"
                  "<text x=\"400\" y=\"248\" fill=\"#a25602\">the guess</text>\n"
                  "<text x=\"400\" y=\"266\" fill=\"#253c9f\">what is found</text>\n</svg>\n");
    fclose(file);
}

/* -- all together ------------------------------------------------------------------------------------ */

static const char *search(fit *f, double *v)
{
    nlopt_opt opt = nlopt_create(NLOPT_LD_SLSQP, UNKNOWNS);
    double slack[3] = {0, 0, 0}, value = HUGE_VAL;
    nlopt_set_lower_bounds(opt, least);
    nlopt_set_upper_bounds(opt, most);
    nlopt_set_min_objective(opt, distance, f);
    nlopt_add_inequality_mconstraint(opt, 3, grashof, NULL, slack);
    nlopt_set_maxeval(opt, 2000);
    nlopt_set_stopval(opt, 1e-20);
    memcpy(v, guess, sizeof guess);
    nlopt_result result = nlopt_optimize(opt, v, &value);
    nlopt_destroy(opt);
    memcpy(v, f->at, sizeof f->at);
    return nlopt_result_to_string(result);
}

static int run(kempe_context *context, const char *path, const char *picture)
{
    kempe_model *model = NULL;
    fit f = {.best = HUGE_VAL};
    double v[UNKNOWNS], met = HUGE_VAL, off = HUGE_VAL;
    kempe_gradient_options options = {.parameters = "crank,coupler,rocker,base,along,across,x,y,tilt",
                                      .driven = "crank"};
    if (kempe_model_read(context, path, &model) == KEMPE_OK && read_places(&f, path) &&
        kempe_gradient_new(model, &options, &f.gradient) == KEMPE_OK) {
        off = check_gradient(&f, guess);
        double before = sqrt(distance(UNKNOWNS, guess, NULL, &f));
        f.evaluations = 0;
        clock_t begin = clock();
        const char *end = search(&f, v);
        double spent = (double)(clock() - begin) / CLOCKS_PER_SEC;
        long evaluations = f.evaluations;
        met = sqrt(distance(UNKNOWNS, v, NULL, &f));
        printf("%d places; gradient against differences: %.1e\n", f.count, off);
        printf("distance (root mean square) before %.3g m, after %.3g m\n", before, met);
        printf("%ld evaluations, %.3g us each, %s\n%-10s%14s%22s\n", evaluations, 1e6 * spent / (double)evaluations,
               end, "", "guess", "found");
        for (int i = 0; i < UNKNOWNS; i++)
            printf("%-10s%14g%22.10f\n", names[i], guess[i], v[i]);
        if (picture)
            draw(picture, &f, v);
    } else {
        fprintf(stderr, "%s\n", kempe_context_message(context));
    }
    kempe_gradient_free(f.gradient);
    kempe_model_free(model);
    return met < 1e-6 && off < 1e-7 ? 0 : 1;
}

int main(int argc, char **argv)
{
    kempe_context *context = kempe_context_new();
    if (!context)
        return 1;
    int failed = run(context, argc > 1 ? argv[1] : "examples/coupler_fit/coupler_fit.yaml", argc > 2 ? argv[2] : NULL);
    kempe_context_free(context);
    return failed;
}
