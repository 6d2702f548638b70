/* SPDX-License-Identifier: BSD-3-Clause */
/* Factors of units against NIST Special Publication 811 (2008), appendix B.8, with its seven digits; units in which
 * results are shown, which read back as what they were. */
#include "base/context.h"
#include "model/language/dimension.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <string.h>

static kempe_context *context;

static double factor_of(const char *text, kmp_unit *unit)
{
    CHECK(kmp_unit_read(text, strlen(text), unit));
    return unit->factor / unit->divisor;
}

static void factors(void)
{
    static const struct {
        const char *unit, *si;
        double factor;
    } rows[] = {
        {"in", "m", 2.54e-2},
        {"ft", "m", 3.048e-1},
        {"yd", "m", 9.144e-1},
        {"mi", "m", 1.609344e3},
        {"thou", "m", 2.54e-5},
        {"deg", "rad", 1.745329e-2},
        {"arcmin", "rad", 2.908882e-4},
        {"arcsec", "rad", 4.848137e-6},
        {"rev", "rad", 6.283185},
        {"rpm", "rad/s", 1.047198e-1},
        {"h", "s", 3.6e3},
        {"km/h", "m/s", 2.777778e-1},
        {"mph", "m/s", 4.4704e-1},
        {"mi/h", "m/s", 4.4704e-1},
        {"gn", "m/s^2", 9.80665},
        {"in/s^2", "m/s^2", 2.54e-2},
        {"lb", "kg", 4.5359237e-1},
        {"oz", "kg", 2.834952e-2},
        {"slug", "kg", 1.459390e1},
        {"tonne", "kg", 1e3},
        {"lbf", "N", 4.448222},
        {"ozf", "N", 2.780139e-1},
        {"kip", "N", 4.448222e3},
        {"kgf", "N", 9.80665},
        {"lb*gn", "N", 4.448222},
        {"psi", "Pa", 6.894757e3},
        {"ksi", "Pa", 6.894757e6},
        {"lbf/in^2", "Pa", 6.894757e3},
        {"atm", "Pa", 1.01325e5},
        {"bar", "Pa", 1e5},
        {"hp", "W", 7.456999e2},
        {"PS", "W", 7.354988e2},
        {"lbf*ft", "N m", 1.355818},
        {"lbf in", "N m", 1.129848e-1},
        {"ozf*in", "N m", 7.061552e-3},
        {"kNm", "kN*m", 1},
        {"Nmm", "N*mm", 1},
        {"lbf/in", "N/m", 1.751268e2},
        {"lbf/ft", "N/m", 1.459390e1},
        {"kN/mm", "N/m", 1e6},
        {"lb*in^2", "kg m^2", 2.926397e-4},
        {"lb*ft^2", "kg m^2", 4.214011e-2},
        {"lb/in^3", "kg/m^3", 2.767990e4},
        {"slug/ft^3", "kg/m^3", 5.153788e2},
        {"deg/s^2", "rad/s^2", 1.745329e-2},
    };
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        kmp_unit unit, si;
        const double found = factor_of(rows[k].unit, &unit) / factor_of(rows[k].si, &si);
        CHECK_NEAR(found / rows[k].factor, 1, 5.1e-7);
        CHECK(kmp_dimension_fits(unit.dimension, si.dimension) && unit.angle == si.angle);
        if (!kmp_dimension_fits(unit.dimension, si.dimension))
            CHECK_TEXT(rows[k].unit, rows[k].si);
    }
}

/* Whole numbers of inches are the nearest to their decimal number of metres. */
static void exact(void)
{
    double x = 0;
    CHECK(kempe_number_read(context, "10 in", "m", &x) == KEMPE_OK && x == 0.254);
    CHECK(kempe_number_read(context, "100 lb", "kg", &x) == KEMPE_OK && x == 45.359237);
    CHECK(kempe_number_read(context, "1 lbf", "N", &x) == KEMPE_OK && x == 4.4482216152605);
    CHECK(kempe_number_read(context, "3 lb", "N", &x) == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(context), "'3 lb' is in kg: a number in N is expected");
}

/* A number in SI times the factor, read with the name that it is shown with, is that number. */
static void shown(void)
{
    static const char *const units[] = {"m",       "m/s",   "m/s^2",   "kg",      "N",  "N m", "N/m",
                                        "N m/rad", "N s/m", "kg m^2",  "kg/m^3",  "Pa", "J",   "W",
                                        "1/m",     "rad",   "rad/s^2", "m^2/s^2", "s",  "Hz",  "N m s"};
    static const char *const systems[] = {"si", "mm", "us"};
    static const char *const words[][4] = {{"N m", "N m", "N mm", "lbf in"},
                                           {"kg m^2", "kg m^2", "kg mm^2", "lb in^2"},
                                           {"rad/s", "rad/s", "rad/s", "rad/s"},
                                           {"Pa", "Pa", "MPa", "psi"},
                                           {"", "", "", ""},
                                           {"m/(N m)", "m/(N m)", "mm/(N mm)", "in/(lbf in)"},
                                           {"N/m^1.5", "N/m^1.5", "N/mm^1.5", "lbf/in^1.5"},
                                           {"W", "W", "W", "hp"}};
    for (int s = 0; s < 3; s++) {
        CHECK(kempe_context_set_units(context, systems[s]) == KEMPE_OK);
        for (size_t k = 0; k < sizeof units / sizeof *units; k++) {
            kmp_unit in, si;
            const kmp_shown as = kmp_shown_as(context, units[k]);
            CHECK_NEAR(as.factor * factor_of(as.unit, &in) / factor_of(units[k], &si), 1, 1e-15);
            CHECK(kmp_dimension_fits(in.dimension, si.dimension) && in.angle == si.angle);
        }
        for (size_t k = 0; k < sizeof words / sizeof *words; k++)
            CHECK_TEXT(kmp_shown_as(context, words[k][0]).unit, words[k][s + 1]);
        CHECK_NEAR(kmp_shown_as(context, "m/(N m)").factor / (s == 0 ? 1 : s == 1 ? 1 : 4.4482216152605), 1, 1e-15);
        CHECK_NEAR(kmp_shown_as(context, "N/m^1.5").factor,
                   s == 0   ? 1
                   : s == 1 ? 3.1622776601683794e-05
                            : 9.100477050292549e-4,
                   1e-13);
    }
    CHECK(kempe_context_set_angle_unit(context, "deg") == KEMPE_OK);
    CHECK_TEXT(kmp_shown_as(context, "rad/s").unit, "deg/s");
    CHECK_TEXT(kmp_shown_as(context, "N m").unit, "lbf in");
    kempe_context *below = kmp_context_new_below(context);
    CHECK(below != NULL);
    CHECK_TEXT(kmp_shown_as(below, "m").unit, "in");
    CHECK_TEXT(kmp_shown_as(below, "rad").unit, "deg");
    kempe_context_free(below);
    CHECK(kempe_context_set_units(context, "cgs") == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(context), "unknown system of units 'cgs'; there are si, mm and us");
}

int main(void)
{
    context = kempe_context_new();
    TEST(factors);
    TEST(exact);
    TEST(shown);
    kempe_context_free(context);
    return check_report();
}
