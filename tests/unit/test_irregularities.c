/* SPDX-License-Identifier: BSD-3-Clause */
/* Irregularities of tracks: tables at either rail, and what is made of spectra against their densities. */
#include "model/data/model.h"
#include "rail/model/read_tracks.h"
#include "sections.h"

static kempe_context *context;
static const double pi = 3.14159265358979323846;

static kempe_model *read_track(const char *rest)
{
    char text[2048];
    kempe_model *model = NULL;
    (void)snprintf(text, sizeof text,
                   "kempe: 1\nground: {points: {O: [0, 0, 0]}}\n"
                   "bodies: {a: {joint: {prismatic: x, at: ground}, mass: 1}}\n"
                   "profiles: {head: {y: [-36 mm, -30 mm, -20 mm, 0, 20 mm, 30 mm, 36 mm],"
                   " z: [-28 mm, -9 mm, -1 mm, 0, -1 mm, -9 mm, -28 mm]}}\n"
                   "tables:\n"
                   "  bend: {x: [0, 10, 20, 30], y: [0, 1 mm, 4 mm, 9 mm]}\n"
                   "  joint: {x: [9, 9.5, 10, 10.5, 11], y: [0, -1 mm, -8 mm, -1 mm, 0]}\n"
                   "  gap: {x: [0, 10, 10.006, 10.012, 20], y: [0, 0, -1 mm, 0, 0], method: linear}\n"
                   "  wide: {x: [0, 30], y: [0, 3 mm], method: linear}\n"
                   "tracks: {line: {at: ground.O, rail: head, gauge: 1435 mm, %s}}\n",
                   rest);
    if (kempe_model_read_text(context, text, "model.yaml", &model) != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(model != NULL);
    return model;
}

/* -- tables -------------------------------------------------------------------------------------- */

/* Each of them alone, and their rates, on a straight track and on a curved one. */
static void tables(void)
{
    static const char *const what[4] = {"alignment: bend", "level: bend", "cross: bend", "gauge: wide"};
    static const double share[4][4] = {{1, -1, 0, 0}, {0, 0, 1, 1}, {0, 0, 0.5, -0.5}, {0.5, 0.5, 0, 0}};
    for (int k = 0; k < 8; k++) {
        char rest[256];
        section s;
        (void)snprintf(rest, sizeof rest, "%sirregularities: {%s}", k < 4 ? "" : "course: [{straight: 40}], ",
                       what[k % 4]);
        kempe_model *m = read_track(rest);
        if (!m || !section_init(&s, m, &m->tracks[0]))
            return;
        const double p[3] = {15, 0.7, 0.4}, value = k % 4 == 3 ? 1.5e-3 : 2.25e-3, rate = k % 4 == 3 ? 1e-4 : 3e-4;
        section_at(&s, p);
        for (int i = 0; i < 4; i++) {
            CHECK(fabs(s.value[OUTWARDS + i] - share[k % 4][i] * value) < 1e-16);
            CHECK(fabs(s.slope[OUTWARDS + i] - share[k % 4][i] * rate) < 1e-16);
        }
        section_free(&s);
        kempe_model_free(m);
    }
}

/* A dipped joint of the left rail: level and cross together; and a gap of both. */
static void joints(void)
{
    kempe_model *m = read_track("irregularities: {level: joint, cross: gap}");
    section s;
    if (!m || !section_init(&s, m, &m->tracks[0]))
        return;
    const double places[4] = {10, 10.006, 10.009, 8};
    for (int k = 0; k < 4; k++) {
        const double p[3] = {places[k], 0, 0};
        section_at(&s, p);
        double dip = kmp_table_value(m->tables[1].table, 0, places[k]), gap = k == 1 ? -1e-3 : k == 2 ? -0.5e-3 : 0;
        CHECK(fabs(s.value[UPWARDS] - (dip + gap / 2)) < 1e-15 && fabs(s.value[UPWARDS + 1] - (dip - gap / 2)) < 1e-15);
        CHECK(k != 0 || fabs(dip + 0.008) < 1e-17);
        CHECK(s.value[OUTWARDS] == 0 && s.value[OUTWARDS + 1] == 0);
    }
    section_free(&s);
    kempe_model_free(m);
}

/* -- spectra ------------------------------------------------------------------------------------- */

static double simpson(kmp_irregularity what, double low, double high)
{
    double sum = 0, step = (high - low) / 20000;
    for (int k = 0; k < 20000; k++)
        sum += step / 6 *
               (kmp_wave_spectrum_density(0, what, low + k * step) +
                4 * kmp_wave_spectrum_density(0, what, low + (k + 0.5) * step) +
                kmp_wave_spectrum_density(0, what, low + (k + 1) * step));
    return sum;
}

/* The integrals of the densities, by hand: partial fractions with wr = 0 but for the cross level. */
static void densities(void)
{
    double low = 2 * pi / 25, high = 2 * pi / 3, wc = 0.8246;
    double exact = 4.032e-7 * (1 / low - 1 / high - (atan(high / wc) - atan(low / wc)) / wc);
    CHECK(fabs(simpson(KMP_IRREGULARITY_LEVEL, low, high) / exact - 1) < 5e-3); /* wr = 0.0206 against 0.25 */
    CHECK(fabs(simpson(KMP_IRREGULARITY_ALIGNMENT, low, high) / exact * 4.032 / 2.119 - 1) < 5e-3);
    double w = 0.3, form = wc * wc / ((w * w + 0.0206 * 0.0206) * (w * w + wc * wc));
    CHECK_NEAR(kmp_wave_spectrum_density(1, KMP_IRREGULARITY_CROSS, w) * 1e6,
               4 * 1.08 * form * w * w / (w * w + 0.438 * 0.438), 1e-14);
    CHECK(kmp_wave_spectrum_density(1, KMP_IRREGULARITY_GAUGE, w) == 0);
}

/* Twice |integral of f cos, sin|^2 over the length, by it, is the density in expectation (times pi): over a band. */
static double band_power(const kmp_table *t, double from, double to, double low, double high)
{
    double length = to - from, power = 0, step = 2 * pi / length;
    for (double w = ceil(low / step) * step; w < high; w += step) {
        double c = 0, s = 0, h = 0.2;
        for (double x = from; x < to - h / 2; x += h) {
            double f = kmp_table_value(t, 0, x) * h;
            c += f * cos(w * x);
            s += f * sin(w * x);
        }
        power += 2 * (c * c + s * s) / (length * length);
    }
    return power;
}

static void spectra(void)
{
    static const double bands[4] = {100, 30, 10, 3}; /* m */
    kempe_model *m = read_track("irregularities: {spectrum: low, seed: 7, from: 50, to: 2050}");
    if (!m)
        return;
    const kmp_irregularities *all = &m->tracks[0].irregularities;
    CHECK(!all->made[KMP_IRREGULARITY_GAUGE]);
    for (int k = 0; k < 3; k++) {
        const kmp_table *t = all->made[k];
        double square = 0;
        for (double x = 50.05; x < 2050; x += 0.1)
            square += kmp_table_value(t, 0, x) * kmp_table_value(t, 0, x) * 0.1;
        double variance = simpson((kmp_irregularity)k, 2 * pi / 100, 2 * pi / 3);
        printf("variance %g, of its spectrum %g; standard deviation %.3g mm; in bands", square / 2000, variance,
               1e3 * sqrt(variance));
        CHECK(fabs(square / 2000 / variance - 1) < 0.08); /* random, and the ends rise over 10 m */
        for (int b = 0; b < 3; b++) {
            double low = 2 * pi / bands[b], high = 2 * pi / bands[b + 1];
            double ratio = band_power(t, 50, 2050, low, high) / simpson((kmp_irregularity)k, low, high);
            printf(" %.3f", ratio);
            CHECK(fabs(ratio - 1) < 0.12);
        }
        printf("\n");
        for (int d = 0; d < 3; d++)
            CHECK(fabs(kmp_table_value(t, d, 48)) < 1e-9 && fabs(kmp_table_value(t, d, 2060)) < 1e-9);
    }
    kempe_model_free(m);
}

/* The seed alone decides; alignment and level have phases of their own; a table goes before. */
static void seeds(void)
{
    static const char *const rest[4] = {"irregularities: {spectrum: low, seed: 1, to: 100}",
                                        "irregularities: {spectrum: low, seed: 1, to: 100, scale: 2}",
                                        "irregularities: {spectrum: low, seed: 2, to: 100, wavelengths: [3, 100]}",
                                        "irregularities: {spectrum: high, seed: 1, to: 100, level: bend}"};
    kempe_model *m[4];
    const kmp_irregularities *all[4];
    double v[4][2];
    for (int k = 0; k < 4; k++) {
        m[k] = read_track(rest[k]);
        if (!m[k])
            return;
        all[k] = &m[k]->tracks[0].irregularities;
        for (int i = 0; i < 2; i++)
            v[k][i] = all[k]->made[i] ? kmp_table_value(all[k]->made[i], 0, 40) : 0;
    }
    CHECK_NEAR(v[1][0] / v[0][0], 2, 1e-12);
    CHECK_NEAR(v[1][1] / v[0][1], 2, 1e-12);
    CHECK(fabs(v[2][0] / v[0][0] - 1) > 0.01);
    CHECK(fabs(v[0][1] / v[0][0] / sqrt(4.032 / 2.119) - 1) > 0.01);
    CHECK_NEAR(v[3][0] / v[0][0], sqrt(6.125 / 2.119), 1e-12);
    CHECK(!all[3]->made[KMP_IRREGULARITY_LEVEL] && all[3]->named[KMP_IRREGULARITY_LEVEL] == &m[3]->tables[0]);
    char *text = NULL;
    CHECK(kempe_model_print(m[3], KEMPE_JSON, &text) == KEMPE_OK);
    CHECK(strstr(text, "\"irregularities\": {\"level\": \"bend\", \"spectrum\": \"high\", \"seed\": 1, \"from\": 0, "
                       "\"to\": 100, \"wavelengths\": [3, 100], \"scale\": 1}") != NULL);
    kempe_text_free(text);
    for (int k = 0; k < 4; k++)
        kempe_model_free(m[k]);
}

int main(void)
{
    context = kempe_context_new();
    TEST(tables);
    TEST(joints);
    TEST(densities);
    TEST(spectra);
    TEST(seeds);
    kempe_context_free(context);
    return check_report();
}
