/* SPDX-License-Identifier: BSD-3-Clause */
/* Creep laws in closed form. All begin with the linear force over the greatest one, f = F / (friction N):
 *
 *     f = -G a b (C11 x, C22 y + sqrt(a b) C23 spin) / (friction N). */
#include "rail/contact/creep.h"
#include "base/context.h"
#include "rail/contact/fastsim.h"
#include <math.h>
#include <stddef.h>

static const double pi = 3.14159265358979323846;

static int is_creep(const kempe_creep *c)
{
    const double finite[] = {c->a, c->b, c->shear_modulus, c->normal, c->friction, c->slip[0], c->slip[1], c->spin};
    for (size_t k = 0; k < sizeof finite / sizeof *finite; k++)
        if (!isfinite(finite[k]))
            return 0;
    return c->a > 0 && c->b > 0 && c->shear_modulus > 0 && c->poisson >= 0 && c->poisson <= 0.5 && c->normal >= 0 &&
           c->friction >= 0 && c->strips >= 0;
}

/* Kalker 1967 (1990, eq. 5.1): without a bound. */
static void linear(const kempe_creep *c, const kempe_kalker *k, kempe_creep_force *out)
{
    double area = c->a * c->b, g = c->shear_modulus * area, root = sqrt(area);
    out->force[0] = -g * k->c11 * c->slip[0];
    out->force[1] = -g * (k->c22 * c->slip[1] + root * k->c23 * c->spin);
    out->moment = g * root * (k->c23 * c->slip[1] - root * k->c33 * c->spin);
}

static void scale(kempe_creep_force *f, double by)
{
    f->force[0] *= by;
    f->force[1] *= by;
    f->moment *= by;
}

/* Vermeulen and Johnson 1964; for ellipses and spin Shen, Hedrick and Elkins 1983: |F| = bound (t - t^2/3 + t^3/27) up
 * to t = |linear F| / bound = 3. The moment is reduced by the same factor as the force. */
static void shen(const kempe_creep *c, const kempe_kalker *k, kempe_creep_force *out)
{
    linear(c, k, out);
    double size = hypot(out->force[0], out->force[1]), bound = c->friction * c->normal, t = size / bound;
    if (bound == 0)
        scale(out, 0);
    else if (t < 3)
        scale(out, 1 + t * (t / 27 - 1.0 / 3));
    else
        scale(out, bound / size);
}

static double over_tanh(double x)
{
    return fabs(x) < 1e-8 ? 1 : tanh(x) / x;
}

/* Jaschinski 1990: each component is saturated separately; the moment with the magnitude of the force. */
static void by_tanh(const kempe_creep *c, const kempe_kalker *k, kempe_creep_force *out)
{
    linear(c, k, out);
    double bound = c->friction * c->normal;
    if (bound == 0) {
        scale(out, 0);
        return;
    }
    out->moment *= over_tanh(hypot(out->force[0], out->force[1]) / bound);
    for (int i = 0; i < 2; i++)
        out->force[i] *= over_tanh(out->force[i] / bound);
}

/* Polach 1999 (A fast wheel-rail forces calculation computer code). With y' = the greater in size of y and y + a spin,
 * s = |(x, y')|, and C = |(C11 x, C22 y)| / |(x, y)|:
 *
 *     e = pi G a b C s / (4 bound),  F = -bound (2/pi) (e / (1 + e^2) + atan e) (x, y) / s,
 *     d = (8/3) G b sqrt(a b) C23 |y'| / (bound k),  k = 1 + 6.3 (1 - exp(-a/b)),
 *     of spin: F_y = -(9/16) a bound k K spin / s,
 *
 * where his K of delta = (d^2 - 1)/(d^2 + 1) is 2/3 d / (1 + d^2)^2: put in and multiplied out.
 *
 * C of small creep depends on the direction alone, so that the law as printed has no derivatives without creep. Within
 * n = KMP_POLACH_NEAR, C^2 is ((C11 x)^2 + (C22 y)^2 + (Cii n)^2) / (x^2 + y^2 + n^2) with C11 for F_x and C22 for F_y:
 * the derivatives without creep are those of the linear theory. */
static void polach(const kempe_creep *c, const kempe_kalker *k, kempe_creep_force *out)
{
    double x = c->slip[0], y = c->slip[1], turned = y + c->a * c->spin, bound = c->friction * c->normal;
    double reach = fmax(fabs(y), fabs(turned)), s = hypot(x, reach), near = KMP_POLACH_NEAR;
    *out = (kempe_creep_force){0};
    if (s == 0 || bound == 0)
        return;
    double g = c->shear_modulus * c->b / bound, weighted = hypot(k->c11 * x, k->c22 * y);
    double of_x = hypot(weighted, k->c11 * near), of_y = hypot(weighted, k->c22 * near);
    double slope = of_y / hypot(hypot(x, y), near);
    double e = 0.25 * pi * g * c->a * slope * s, along = bound * 2 / pi * (e / (1 + e * e) + atan(e)) / s;
    double far = 1 + 6.3 * -expm1(-c->a / c->b), d = 8.0 / 3 * g * sqrt(c->a * c->b) * k->c23 * reach / far;
    double spin = 9.0 / 16 * c->a * bound * far * (2.0 / 3) * d / ((1 + d * d) * (1 + d * d)) / s;
    out->force[0] = -along * x * of_x / of_y;
    out->force[1] = -along * y - spin * c->spin;
}

static void none(const kempe_creep *c, const kempe_kalker *k, kempe_creep_force *out)
{
    (void)c, (void)k;
    *out = (kempe_creep_force){0};
}

static void fastsim(const kempe_creep *c, const kempe_kalker *k, kempe_creep_force *out)
{
    double flexibility[3];
    kmp_fastsim_flexibilities(c, k, flexibility);
    kmp_fastsim(c, flexibility, out);
}

static void fastsim_of_one(const kempe_creep *c, const kempe_kalker *k, kempe_creep_force *out)
{
    double one = kmp_fastsim_flexibility(c, k);
    kmp_fastsim(c, (const double[]){one, one, one}, out);
}

static const struct {
    const char *name;
    void (*force)(const kempe_creep *, const kempe_kalker *, kempe_creep_force *);
} laws[] = {{"none", none},       {"linear", linear},          {"shen", shen}, {"polach", polach}, {"tanh", by_tanh},
            {"fastsim", fastsim}, {"fastsim1", fastsim_of_one}};

enum { LAWS = sizeof laws / sizeof *laws };

const char *kempe_contact_law_name(kempe_creep_law law)
{
    return (unsigned)law < LAWS ? laws[law].name : NULL;
}

kempe_status kempe_contact_creep(kempe_creep_law law, const kempe_creep *creep, kempe_creep_force *force)
{
    KMP_WANTED(NULL, creep, "creep");
    KMP_WANTED(NULL, force, "force");
    kempe_kalker coefficients;
    if ((unsigned)law >= LAWS || !is_creep(creep))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(kempe_contact_kalker(creep->a / creep->b, creep->poisson, &coefficients));
    kempe_creep_force found = {0};
    laws[law].force(creep, &coefficients, &found);
    *force = found;
    return KEMPE_OK;
}

kempe_status kempe_contact_flexibilities(const kempe_creep *creep, double flexibility[3])
{
    KMP_WANTED(NULL, creep, "creep");
    KMP_WANTED(NULL, flexibility, "flexibility");
    kempe_kalker coefficients;
    if (!is_creep(creep) || kempe_contact_kalker(creep->a / creep->b, creep->poisson, &coefficients) != KEMPE_OK)
        return KEMPE_E_ARGUMENT;
    kmp_fastsim_flexibilities(creep, &coefficients, flexibility);
    return KEMPE_OK;
}

kempe_status kempe_contact_flexibility(const kempe_creep *creep, double *flexibility)
{
    KMP_WANTED(NULL, creep, "creep");
    KMP_WANTED(NULL, flexibility, "flexibility");
    kempe_kalker coefficients;
    if (!is_creep(creep) || kempe_contact_kalker(creep->a / creep->b, creep->poisson, &coefficients) != KEMPE_OK)
        return KEMPE_E_ARGUMENT;
    *flexibility = kmp_fastsim_flexibility(creep, &coefficients);
    return KEMPE_OK;
}

kempe_status kempe_contact_fastsim(const kempe_creep *creep, const double flexibility[3], kempe_creep_force *force)
{
    KMP_WANTED(NULL, creep, "creep");
    KMP_WANTED(NULL, flexibility, "flexibility");
    KMP_WANTED(NULL, force, "force");
    if (!is_creep(creep))
        return KEMPE_E_ARGUMENT;
    for (int k = 0; k < 3; k++)
        if (!isfinite(flexibility[k]) || flexibility[k] <= 0)
            return KEMPE_E_ARGUMENT;
    kempe_creep_force found = {0};
    kmp_fastsim(creep, flexibility, &found);
    *force = found;
    return KEMPE_OK;
}
