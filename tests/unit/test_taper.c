/* SPDX-License-Identifier: BSD-3-Clause */
/* Beams whose sections change along them: exact frequencies of wedges and cones (Kirchhoff 1879, by Bessel functions),
 * compliances and loads of closed form, values of parameters, pieces of segments. */
#include "loaded.h"
#include "model/data/flexible.h"
#include "model/data/model.h"
#include "model/data/variant.h"
#include "testing.h"
#include <kempe/table.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static kempe_model *read_beam(kempe_context *context, const char *beam, const char *keys)
{
    char text[1024];
    kempe_model *model = NULL;
    (void)snprintf(text, sizeof text,
                   "kempe: 1\nparameters: {L: 0.7, E: 70 GPa, rho: 2700, b: 30 mm}\nbodies:\n  rod:\n"
                   "    joint: {weld: yes, at: ground}\n    flexible:\n      beam: {%s}\n      %s\n"
                   "    points: {end: {station: L}, mid: {station: L/2, offset: [0, 5 mm, 0]}}\n",
                   beam, keys);
    if (kempe_model_read_text(context, text, "beam.yaml", &model) != KEMPE_OK)
        printf("%s\n%s\n", kempe_context_message(context), text);
    CHECK(model && model->flexible_count == 1);
    return model;
}

static double mass(const kmp_flexible *f, int k)
{
    const kmp_number *t = f->by_field + 9 * ((ptrdiff_t)(f->count + f->quadratic_count) * k + k);
    return t[0].value + t[4].value + t[8].value;
}

/* I_n(x) = sum (x/2)^(n + 2 k)/(k! (n + k)!) */
static double modified_bessel(int n, double x)
{
    double term = 1, sum = 0;
    for (int k = 1; k <= n; k++)
        term *= x / 2 / k;
    for (int k = 1; k < 200; k++) {
        sum += term;
        term *= x * x / 4 / (k * (n + k));
    }
    return sum;
}

/* Roots z of J_n I_(n+1) + I_n J_(n+1): frequencies (z/2)^2 sqrt(E I/rho A)/L^2, I and A at the clamped end. n: 1 of a
 * wedge, 2 of a cone. */
static double root_of_point(int n, int which)
{
    double low = 0.5, high = 0.5;
    for (int found = -1; found < which; high += 0.01) {
        const double a = jn(n, high) * modified_bessel(n + 1, high) + modified_bessel(n, high) * jn(n + 1, high);
        const double z = high + 0.01;
        const double b = jn(n, z) * modified_bessel(n + 1, z) + modified_bessel(n, z) * jn(n + 1, z);
        if (a * b <= 0 && ++found == which)
            low = high;
    }
    double top = low + 0.01;
    const double start = jn(n, low) * modified_bessel(n + 1, low) + modified_bessel(n, low) * jn(n + 1, low);
    for (int i = 0; i < 60; i++) {
        const double z = (low + top) / 2;
        const double value = jn(n, z) * modified_bessel(n + 1, z) + modified_bessel(n, z) * jn(n + 1, z);
        if (value * start > 0)
            low = z;
        else
            top = z;
    }
    return low;
}

static void wedges_and_cones(void)
{
    static const struct {
        const char *beam;
        int n;
        double gyration, first; /* of the section at the clamped end; as it is tabulated */
    } row[] = {
        {"section: {rectangle: [30 mm, 20 mm]}, taper: {rectangle: [0, 20 mm]}", 1, 0.03 / 3.4641016151377544, 5.315},
        {"section: {circle: 30 mm}, taper: {circle: 0 mm}", 2, 0.03 / 4, 8.719}};
    kempe_context *context = kempe_context_new();
    for (int i = 0; i < 2; i++) {
        char text[256];
        (void)snprintf(text, sizeof text, "length: L, young: E, density: rho, %s", row[i].beam);
        kempe_model *m = read_beam(context, text, "shapes: {y: 10}");
        const kmp_flexible *f = m ? m->flexibles : NULL;
        const double scale = sqrt(70e9 / 2700) * row[i].gyration / (0.7 * 0.7);
        CHECK_NEAR(pow(root_of_point(row[i].n, 0) / 2, 2), row[i].first, 5e-4);
        for (int k = 0; k < 3 && f; k++) {
            const double exact = pow(root_of_point(row[i].n, k) / 2, 2) * scale;
            const double found = sqrt(f->stiffness[(f->count + 1) * k].value / mass(f, k));
            CHECK_NEAR(found / exact, 1, 1e-8);
            for (int l = k + 1; l < f->count; l++)
                CHECK(f->stiffness[f->count * k + l].value == 0);
        }
        kempe_model_free(m);
    }
    kempe_context_free(context);
}

/* With diameters d and r d: L^3/(3 E I r) of a force at the end, L (1/r^3 - 1)/(3 (1 - r) G J) of a torque, 4 L/(pi E
 * r d^2) of a pull. */
static void compliances(void)
{
    const double pi = acos(-1), second = pi * pow(0.03, 4) / 64, r = 0.5, length = 0.7, shear = 70e9 / 2.6;
    const double exact[3] = {pow(length, 3) / (3 * 70e9 * second * r),
                             length * (1 / (r * r * r) - 1) / (3 * (1 - r) * shear * 2 * second),
                             4 * length / (pi * 70e9 * r * 9e-4)};
    kempe_context *context = kempe_context_new();
    kempe_model *m = read_beam(
        context, "length: L, young: E, poisson: 0.3, density: rho, section: {circle: b}, taper: {circle: b/2}",
        "shapes: {y: 12, torsion: 12, axial: 12}");
    const kmp_flexible *f = m ? m->flexibles : NULL;
    double sum[3] = {0};
    for (int k = 0; f && k < f->count; k++) {
        const kmp_station *end = &f->stations[1];
        const double way = k < 12 ? end->shift[f->count + k].value : k < 24 ? end->turn[k].value : end->shift[k].value;
        sum[k / 12] += way * way / f->stiffness[(f->count + 1) * k].value;
    }
    for (int c = 0; c < 3; c++)
        CHECK_NEAR(sum[c] / exact[c], 1, 1e-7);
    kempe_model_free(m);
    kempe_context_free(context);
}

/* A cone that turns with 7 rad/s pulls with rho 49 times the integral of pi d^2/4 x beyond the section. */
static void spinning_cone(void)
{
    static const char text[] =
        "kempe: 1\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n    flexible:\n"
        "      beam: {length: 1, young: 70 GPa, density: 2700, section: {circle: 20 mm}, taper: {circle: 10 mm}}\n"
        "      shapes: {y: 2}\n    points: {root: {station: 0}, mid: {station: 0.4, offset: [0, 1 mm, 0]}}\n"
        "start: {qd: {A: 7}}\nrun: {t_end: 1 us, outputs: [section(rod.mid), stress(rod.mid), section(rod.root)]}\n";
    const double quarter = acos(-1) / 4, d = 0.02, fall = 0.01;
    double exact[2];
    for (int k = 0; k < 2; k++) { /* of (d - fall x)^2 x */
        const double x = k == 0 ? 0.4 : 0;
        exact[k] = d * d * (1 - x * x) / 2 - 2 * d * fall * (1 - x * x * x) / 3 + fall * fall * (1 - x * x * x * x) / 4;
        exact[k] *= 49 * 2700 * quarter;
    }
    loaded l = load_text(text);
    kempe_trajectory *t = NULL;
    kempe_table *table = NULL;
    CHECK(l.system && kempe_simulate(l.system, NULL, &t) == KEMPE_OK &&
          kempe_trajectory_outputs(t, "section(rod.mid),stress(rod.mid),section(rod.root)", &table) == KEMPE_OK);
    if (table) {
        CHECK_NEAR(kempe_table_number(table, 0, 1) / exact[0], 1, 1e-12);
        CHECK_NEAR(kempe_table_number(table, 0, 7) / (exact[0] / (quarter * pow(d - fall * 0.4, 2))), 1, 1e-12);
        CHECK_NEAR(kempe_table_number(table, 0, 8) / exact[1], 1, 1e-12);
    }
    kempe_table_free(table);
    kempe_trajectory_free(t);
    unload(&l);
}

/* Numbers of an instance with other values, beside the model read with these; the shapes are those of the nominal
 * values, which powers of x do not follow. */
static void other_values(void)
{
    static const char *const names[] = {"L", "E", "rho", "b"};
    static const double values[] = {0.9, 50e9, 3100, 0.02};
    static const kempe_setting set[] = {{"L", "0.9"}, {"E", "50e9"}, {"rho", "3100"}, {"b", "0.02"}};
    static const char *const sections[] = {
        "length: L, young: E, poisson: 0.3, density: rho, section: {rectangle: [b, 12 mm]}, taper: {rectangle: [b/3, 9 "
        "mm]}",
        "length: L, young: E, poisson: 0.3, density: rho, section: {tube: [b, b/2]}, taper: {tube: [25 mm, 3 mm]}"};
    static const char text[] =
        "kempe: 1\nparameters: {L: 0.7, E: 70 GPa, rho: 2700, b: 30 mm}\nbodies:\n  rod:\n    joint: {weld: yes, at: "
        "ground}\n"
        "    flexible:\n      beam: {%s}\n      shapes: {y: 2, z: 1, torsion: 1}\n      raw: yes\n      frame: %s\n"
        "    points: {end: {station: L}, mid: {station: L/2, offset: [0, 5 mm, 0]}}\n";
    for (int i = 0; i < 4; i++) {
        char own[1024];
        (void)snprintf(own, sizeof own, text, sections[i % 2], i < 2 ? "clamped" : "chord");
        kempe_context *context = kempe_context_new();
        kempe_model *nominal = NULL, *with = NULL, *instance = NULL;
        CHECK(kempe_model_read_text(context, own, "beam.yaml", &nominal) == KEMPE_OK &&
              kempe_model_read_text_set(context, own, "beam.yaml", set, 4, &with) == KEMPE_OK &&
              kmp_variant_instance(nominal, 4, names, values, &instance) == KEMPE_OK);
        for (int k = 0; with && instance && k < with->flexibles->number_count; k++) {
            const double a = instance->flexibles->numbers[k].value, b = with->flexibles->numbers[k].value;
            CHECK(fabs(a - b) <= 1e-13 + 1e-11 * fabs(b));
        }
        CHECK(instance && nominal && instance->flexibles->mass->value != nominal->flexibles->mass->value);
        kempe_model_free(instance);
        kempe_model_free(with);
        kempe_model_free(nominal);
        kempe_context_free(context);
    }
}

/* Pieces have together the mass, centre and inertia of the beam, and the compliance of its joints by 1/N^2. */
static void pieces(void)
{
    kempe_context *context = kempe_context_new();
    const char *beam =
        "length: L, young: E, density: rho, section: {rectangle: [b, 12 mm]}, taper: {rectangle: [b/3, 9 mm]}";
    kempe_model *whole = read_beam(context, beam, "shapes: {y: 1}\n      rotary: yes"), *cut[2] = {NULL};
    double error[2] = {0};
    for (int i = 0; i < 2 && whole; i++) {
        char text[1024];
        const int count = 8 << i;
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nparameters: {L: 0.7, E: 70 GPa, rho: 2700, b: 30 mm}\nbodies:\n  rod:\n"
                       "    joint: {weld: yes, at: ground}\n    flexible: {beam: {%s}, shapes: {y: 1}, rotary: yes, "
                       "segments: %d}\n",
                       beam, count);
        CHECK(kempe_model_read_text(context, text, "beam.yaml", &cut[i]) == KEMPE_OK);
        const kmp_body rigid = kmp_body_undeformed(whole, 1);
        double m = 0, first = 0, about = 0;
        double compliance = 0;
        for (int k = 0; cut[i] && k < count; k++) {
            const kmp_body *piece = &cut[i]->bodies[1 + k];
            const double at = (k == 0 ? 0 : 0.7 * (k - 0.5) / (count - 1)) + piece->com[0].value;
            m += piece->mass.value;
            first += piece->mass.value * at;
            about += piece->inertia[2].value + piece->mass.value * at * at;
            if (k + 1 < count)
                compliance += pow(0.7 * (count - 1.5 - k) / (count - 1), 2) / cut[i]->forces[k].stiffness.value;
        }
        CHECK_NEAR(m / rigid.mass.value, 1, 1e-13);
        CHECK_NEAR(first / m / rigid.com[0].value, 1, 1e-13);
        CHECK_NEAR((about - first * first / m) / rigid.inertia[2].value, 1, 1e-12);
        /* the integral of x^2/E I over the length, by Simpson */
        double exact = 0;
        for (int k = 0; k <= 2000; k++) {
            const double s = k / 2000.0, y = 0.03 - 0.02 * s, z = 0.012 - 0.003 * s, x = 0.7 * (1 - s);
            exact += (k == 0 || k == 2000 ? 1 : k % 2 ? 4 : 2) * 0.7 / 6000 * x * x * 12 / (70e9 * y * y * y * z);
        }
        error[i] = fabs(compliance / exact - 1);
    }
    printf("  compliance of 8 and 16 pieces: %.2g, %.2g\n", error[0], error[1]);
    CHECK(error[1] < 0.3 * error[0] && error[1] < 0.01);
    kempe_model_free(cut[0]);
    kempe_model_free(cut[1]);
    kempe_model_free(whole);
    kempe_context_free(context);
}

/* -- stations ---------------------------------------------------------------------------------------- */

/* Diameters at 0, 0.3 L and L. */
static double diameter(double x)
{
    return x < 0.21 ? 0.03 + 0.01 * x / 0.21 : 0.04 - 0.03 * (x - 0.21) / 0.49;
}

/* The integral of x^power times d^fourth over from .. to, by Gauss's rule of five points in pieces that meet at the
 * station; exact to the degree 9. */
static double integral(double from, double to, int power, int degree)
{
    static const double at[3] = {0, 0.53846931010568309104, 0.90617984593866399280},
                        weight[3] = {0.56888888888888888889, 0.47862867049936646804, 0.23692688505618908751};
    const double end[4] = {from, from < 0.21 && to > 0.21 ? 0.21 : from, to, to};
    double sum = 0;
    for (int piece = 0; piece < 2; piece++)
        for (int k = -2; k <= 2; k++) {
            const double half = (end[piece + 1] - end[piece]) / 2;
            const double x = (end[piece] + end[piece + 1]) / 2 + (k < 0 ? -half : half) * at[abs(k)];
            sum += half * weight[abs(k)] * pow(x, power) * pow(diameter(x), degree);
        }
    return sum;
}

#define STATIONS                                                                                                       \
    "length: L, young: E, density: rho, shear: 26 GPa, taper: {at: [0, 0.3*L, L], section: [{circle: b}, {circle: 40 " \
    "mm}, {circle: 10 mm}]}"

static void integrals_of_pieces(void)
{
    const double pi = acos(-1), area = 2700 * pi / 4, second = pi / 64, length = 0.7;
    kempe_context *context = kempe_context_new();
    kempe_model *m = read_beam(context, STATIONS, "shapes: {y: 2, torsion: 1}\n      raw: yes\n      stiffening: none");
    const kmp_flexible *f = m ? m->flexibles : NULL;
    for (int k = 0; f && k < 2; k++) { /* xi^2, xi^3 */
        const double way = area * integral(0, length, 4 + 2 * k, 2) / pow(length, 4 + 2 * k);
        const double turn = 2700 * second * pow(2 + k, 2) * integral(0, length, 2 + 2 * k, 4) / pow(length, 4 + 2 * k);
        const double bend = k == 0 ? 4 * integral(0, length, 0, 4) : 36 * integral(0, length, 2, 4) / pow(length, 2);
        CHECK_NEAR(mass(f, k) / (way + turn), 1, 1e-13);
        CHECK_NEAR(f->stiffness[4 * k].value / (70e9 * second * bend / pow(length, 4)), 1, 1e-13);
    }
    if (f) {
        const double twist = 26e9 * 2 * second * integral(0, length, 0, 4) / pow(length, 2);
        CHECK_NEAR(f->mass->value / (area * integral(0, length, 0, 2)), 1, 1e-14);
        CHECK_NEAR(f->moment[0].value / (area * integral(0, length, 1, 2)), 1, 1e-14);
        CHECK_NEAR(f->second[0].value / (area * integral(0, length, 2, 2)), 1, 1e-14);
        CHECK_NEAR(f->second[1].value / (2700 * second * integral(0, length, 0, 4)), 1, 1e-14);
        CHECK_NEAR(f->stiffness[8].value / twist, 1, 1e-13);
        CHECK_NEAR(f->stations[2].section[1].value / (second * pow(diameter(length / 2), 4)), 1, 1e-13);
        CHECK_NEAR(f->stations[2].beyond->mass->value / (area * integral(length / 2, length, 0, 2)), 1, 1e-13);
    }
    kempe_model_free(m);
    kempe_context_free(context);
}

/* Of 100 finite elements with Hermite polynomials and 8 Gauss points each, which are converged to 1e-6; 400 of them
 * differ by as much. Smooth shapes are stiffer, and approach from above. */
static void frequencies_of_pieces(void)
{
    static const double elements[3] = {522.7081, 2046.0077, 4729.272};
    static const double within[2][3] = {{3e-4, 3e-4, 6e-4}, {7e-5, 7e-5, 2e-4}};
    for (int i = 0; i < 2; i++) {
        kempe_context *context = kempe_context_new();
        kempe_model *m = read_beam(context, STATIONS, i == 0 ? "shapes: {y: 8}" : "shapes: {y: 12}");
        const kmp_flexible *f = m ? m->flexibles : NULL;
        for (int k = 0; f && k < 3; k++) {
            const double high = sqrt(f->stiffness[(f->count + 1) * k].value / mass(f, k)) / elements[k] - 1;
            CHECK(high > 0 && high < within[i][k]);
        }
        kempe_model_free(m);
        kempe_context_free(context);
    }
}

static void pieces_in_segments(void)
{
    const double area = 2700 * acos(-1) / 4;
    kempe_context *context = kempe_context_new();
    kempe_model *m = NULL;
    CHECK(kempe_model_read_text(context,
                                "kempe: 1\nparameters: {L: 0.7, E: 70 GPa, rho: 2700, b: 30 mm}\nbodies:\n  rod:\n"
                                "    joint: {weld: yes, at: ground}\n    flexible: {beam: {" STATIONS
                                "}, shapes: {y: 1}, segments: 6}\n",
                                "beam.yaml", &m) == KEMPE_OK);
    for (int k = 0; m && k < 6; k++) {
        const double from = k == 0 ? 0 : (k - 0.5) * 0.14, to = k == 5 ? 0.7 : (k + 0.5) * 0.14;
        const kmp_body *piece = &m->bodies[1 + k];
        const double own = area * integral(from, to, 0, 2), centre = area * integral(from, to, 1, 2) / own;
        const double second = area * integral(from, to, 2, 2) - own * centre * centre;
        CHECK_NEAR(piece->mass.value / own, 1, 1e-13);
        CHECK_NEAR(piece->com[0].value + from, centre, 1e-14);
        CHECK_NEAR(piece->inertia[2].value / second, 1, 1e-11);
    }
    kempe_model_free(m);
    kempe_context_free(context);
}

/* The same beam with one taper, and in pieces of it: all numbers but for rounding. */
static void pieces_of_one_taper(void)
{
    static const char both[2][256] = {
        "length: L, young: E, shear: 26 GPa, density: rho, section: {rectangle: [b, 20 mm]}, taper: {rectangle: [b/2, "
        "12 mm]}",
        "length: L, young: E, shear: 26 GPa, density: rho, taper: {at: [0, L/4, L], section: [{rectangle: [b, 20 mm]}, "
        "{rectangle: [0.875*b, 18 mm]}, {rectangle: [b/2, 12 mm]}]}"};
    static const char *const keys[3] = {"shapes: {y: 3, z: 2, torsion: 2, axial: 1}",
                                        "shapes: {y: 3, z: 2}\n      frame: chord",
                                        "shapes: {y: 2, z: 2, torsion: 1}\n      raw: yes\n      stiffening: first"};
    for (int i = 0; i < 3; i++) {
        kempe_context *context = kempe_context_new();
        kempe_model *m[2] = {read_beam(context, both[0], keys[i]), read_beam(context, both[1], keys[i])};
        const kmp_flexible *f[2] = {m[0] ? m[0]->flexibles : NULL, m[1] ? m[1]->flexibles : NULL};
        const int n = f[0] ? f[0]->count : 0;
        for (int k = 0; f[0] && f[1] && k < n; k++) {
            CHECK_NEAR(mass(f[1], k) / mass(f[0], k), 1, 1e-12);
            CHECK_NEAR(f[1]->stiffness[(n + 1) * k].value / f[0]->stiffness[(n + 1) * k].value, 1, 1e-9);
            for (int c = 0; c < 3; c++) {
                const double size = f[0]->mass->value;
                CHECK_NEAR(f[1]->field[3 * k + c].value / size, f[0]->field[3 * k + c].value / size, 1e-12);
                CHECK_NEAR(f[1]->stations[2].shift[n * c + k].value, f[0]->stations[2].shift[n * c + k].value, 1e-11);
            }
        }
        kempe_model_free(m[0]);
        kempe_model_free(m[1]);
        kempe_context_free(context);
    }
}

int main(void)
{
    TEST(wedges_and_cones);
    TEST(compliances);
    TEST(spinning_cone);
    TEST(other_values);
    TEST(pieces);
    TEST(integrals_of_pieces);
    TEST(frequencies_of_pieces);
    TEST(pieces_in_segments);
    TEST(pieces_of_one_taper);
    return check_report();
}
