/* SPDX-License-Identifier: BSD-3-Clause */
/* Constants of beams: deformed moments, energies and stations beside numbers of another program (integrals of powers of
 * x in NumPy), exact frequencies and compliances, other values of parameters, the
 * parts that are zero, poses of what is attached. */
#include "loaded.h"
#include "model/data/flexible.h"
#include "model/data/model.h"
#include "model/data/pose.h"
#include "model/data/variant.h"
#include <kempe/settings.h>

enum { MOST = 8, VALUES = 24 };

static kempe_context *context;

static kempe_model *read_text(const char *text)
{
    kempe_model *model = NULL;
    if (kempe_model_read_text(context, text, "beam.yaml", &model) != KEMPE_OK)
        printf("%s\n%s\n", kempe_context_message(context), text);
    CHECK(model && model->flexible_count > 0);
    return model;
}

/* -- digits -------------------------------------------------------------------------------------------- */

/* At q_k = 0.3 cos(1 + 2 k) and rates sin(0.5 + k): s; P (xx yy zz xy xz yz); ax(sum zd_k Z_k); kinetic energy of the
 * rates, strain energy, power of damping; place of the end; angles at 0.9 m and at 0. Length 1.3 m, 2.1 kg/m, E Iz 7, E
 * Iy 5, G J 3 N m^2, E A 90 N, k G A 60 and 40 N, rho Iy 0.03, rho Iz 0.05 kg m. */
typedef struct known {
    const char *shapes, *frame, *stiffening, *rotary, *shear;
    double value[VALUES];
} known;

static const known table[] = {
    {"y: 3",
     "clamped",
     "none",
     "no",
     "no",
     {1.7745,
      -0.00873456819806263,
      0,
      1.5379,
      0.000644521617200597,
      0,
      -0.0166581811511972,
      0,
      0,
      0,
      0,
      1.48738852385563,
      0.844304395295057,
      0.167740717893884,
      0.519307590022142,
      1.3,
      -0.0498084015807238,
      0,
      0,
      0,
      -0.0689710881445843,
      0,
      0,
      0}},
    {"y: 3",
     "clamped",
     "first",
     "no",
     "no",
     {1.77311491749425,
      -0.00873456819806263,
      0,
      1.53482672302466,
      0.000644521617200597,
      0,
      -0.0166581811511972,
      0,
      0,
      0,
      0,
      1.48738852385563,
      0.844304395295057,
      0.167740717893884,
      0.519307590022142,
      1.29654641645838,
      -0.0498084015807238,
      0,
      0,
      0,
      -0.0689710881445843,
      0,
      0,
      0}},
    {"y: 3",
     "clamped",
     "full",
     "no",
     "no",
     {1.77311491749425,
      -0.00873456819806263,
      0,
      1.53482922096397,
      0.000644521617200597,
      0,
      -0.0166213939345367,
      0,
      0,
      0,
      0,
      1.48754437531485,
      0.848127956671265,
      0.167740717893884,
      0.519307590022142,
      1.29654641645838,
      -0.0498084015807238,
      0,
      0,
      0,
      -0.0689710881445843,
      0,
      0,
      0}},
    {"y: 3",
     "chord",
     "none",
     "no",
     "no",
     {1.7745,
      0.0814952424141471,
      0,
      1.5379,
      0.00392759557283028,
      0,
      0.0354044907170207,
      0,
      0,
      0,
      0,
      0.236191558823572,
      0.021431627578214,
      2.22329980323145,
      0.139201022421715,
      1.3,
      0,
      0,
      0,
      0,
      -0.0937637194283284,
      0,
      0,
      0.418605458753495}},
    {"y: 3",
     "chord",
     "first",
     "no",
     "no",
     {1.75000940397233,
      0.0814952424141471,
      0,
      1.50210090223755,
      0.00392759557283028,
      0,
      0.0354044907170207,
      0,
      0,
      0,
      0,
      0.236191558823572,
      0.021431627578214,
      2.22329980323145,
      0.139201022421715,
      1.28884724891621,
      0,
      0,
      0,
      0,
      -0.0937637194283284,
      0,
      0,
      0.418605458753495}},
    {"y: 3",
     "chord",
     "full",
     "no",
     "no",
     {1.75000940397233,
      0.0814952424141471,
      0,
      1.50233344754637,
      0.00392759557283028,
      0,
      0.0347321712922899,
      0,
      0,
      0,
      0,
      0.233409394660783,
      0.0215283833521296,
      2.22329980323145,
      0.139201022421715,
      1.28884724891621,
      0,
      0,
      0,
      0,
      -0.0937637194283284,
      0,
      0,
      0.418605458753495}},
    {"y: 2, z: 1, torsion: 1",
     "clamped",
     "none",
     "yes",
     "no",
     {1.7745,
      -0.0551984341769391,
      0.0774397766314608,
      1.54002218062418,
      0.0706033327984318,
      0.0440623313183442,
      -0.0598637466906953,
      0.0742477739827665,
      -0.00102814070021466,
      -0.10704781346405,
      -0.559011599742792,
      1.203934116265,
      0.647714050376453,
      1.02536935836178,
      0.25514458748732,
      1.3,
      -0.134907057219692,
      0.0850986556389679,
      0.156579698978994,
      -0.0906376213906167,
      -0.155854488530856,
      0,
      0,
      0}},
    {"y: 2, z: 1, torsion: 1",
     "clamped",
     "first",
     "yes",
     "no",
     {1.7653128349129,
      -0.0595770858403116,
      0.0674419577279145,
      1.51941323377318,
      0.0675956574231638,
      0.0431745160090292,
      -0.0647383247622418,
      0.0629182056636818,
      -0.000330330624905143,
      -0.105961139770153,
      -0.665758908606172,
      1.18072990290988,
      0.647714050376453,
      1.02536935836178,
      0.25514458748732,
      1.27729270018046,
      -0.141322664052472,
      0.0637326185579427,
      0.168605180259673,
      -0.0698631768485274,
      -0.162950494267613,
      0,
      0,
      0}},
    {"y: 2, z: 1, torsion: 1",
     "clamped",
     "full",
     "yes",
     "no",
     {1.7653128349129,
      -0.0595770858403116,
      0.0674419577279145,
      1.51952295924334,
      0.0681516198057295,
      0.0420117839784939,
      -0.0639695185516418,
      0.0624372299490465,
      0.000230828716324318,
      -0.103704695031468,
      -0.655685103715776,
      1.1796244368174,
      0.681360887598448,
      1.02536935836178,
      0.25514458748732,
      1.27729270018046,
      -0.141322664052472,
      0.0637326185579427,
      0.168605180259673,
      -0.0698631768485274,
      -0.162950494267613,
      0,
      0,
      0}},
    {"y: 2, z: 1, torsion: 1",
     "chord",
     "none",
     "yes",
     "no",
     {1.7745,
      0.0737512647510011,
      0.0387198883157304,
      1.53897106485654,
      0.0692025695946814,
      0.0407673208761846,
      0.0302746711334841,
      0.0254734287500404,
      0.00419544548833564,
      -0.013125772992771,
      -0.175620714165935,
      0.201617971653211,
      0.0420330019780535,
      1.94567157252032,
      0.0974395439601735,
      1.3,
      0,
      0,
      0.156579698978994,
      0.0251771170529491,
      -0.11149198528218,
      0,
      -0.0654605043376676,
      0.353144954415827}},
    {"y: 2, z: 1, torsion: 1",
     "chord",
     "first",
     "yes",
     "no",
     {1.75263336014318,   0.0781299164143736,  0.0212106987937561,  1.50615274360205,    0.0670788919595578,
      0.0400466235943671, 0.034668078692572,   0.00903646627421774, 0.00424838786694182, -0.0106219075197877,
      -0.202174281599677, 0.227459826720414,   0.0420330019780535,  1.94567157252032,    0.0974395439601735,
      1.28891797804019,   0.00641560683278025, -0.0122200537926263, 0.164304432901003,   0.0444082329436745,
      -0.104395979545423, -0.0115585234101813, -0.0654605043376676, 0.353144954415827}},
    {"y: 2, z: 1, torsion: 1",
     "chord",
     "full",
     "yes",
     "no",
     {1.75263336014318,   0.0781299164143736,  0.0212106987937561,  1.50634214085641,    0.0671355851896468,
      0.039747266646249,  0.0341105618557688,  0.00888889422113267, 0.00405436794102281, -0.0072218584592585,
      -0.199546109989497, 0.224787304220531,   0.0498471578052776,  1.94567157252032,    0.0974395439601735,
      1.28891797804019,   0.00641560683278025, -0.0122200537926263, 0.164304432901003,   0.0444082329436745,
      -0.104395979545423, -0.0115585234101813, -0.0654605043376676, 0.353144954415827}},
    {"y: 2, z: 2, torsion: 1, axial: 1",
     "clamped",
     "none",
     "yes",
     "yes",
     {1.77631232332611,
      0.11271952390029,
      0.0947940266016326,
      1.54662244158839,
      0.0720017157161085,
      0.0547561762243656,
      0.0835042280667257,
      0.106514410034428,
      -0.000766093626462837,
      -0.101322084301681,
      -0.517539684984171,
      0.756222924004186,
      0.574655092935222,
      2.51814497674312,
      0.325802530064156,
      1.30132770939642,
      -0.0118902381154944,
      0.210897730032348,
      -0.189234746699125,
      -0.340794536919187,
      -0.155854488530856,
      0,
      0,
      0}},
    {"y: 2, z: 2, torsion: 1, axial: 1",
     "clamped",
     "first",
     "yes",
     "yes",
     {1.76200687272223,
      0.122349044878882,
      0.091814141857984,
      1.51295986963746,
      0.0684835503380551,
      0.0501047705402289,
      0.096212333863659,
      0.105530830676894,
      0.00210101507194089,
      -0.104603318679974,
      -0.325970539498339,
      0.858827818358135,
      0.574655092935222,
      2.51814497674312,
      0.325802530064156,
      1.25779760222402,
      0.012918476873481,
      0.220224954132142,
      -0.150517337454403,
      -0.365901538506057,
      -0.115719674504835,
      0,
      0,
      0}},
    {"y: 2, z: 2, torsion: 1, axial: 1",
     "clamped",
     "full",
     "yes",
     "yes",
     {1.76200687272223,
      0.122349044878882,
      0.091814141857984,
      1.51328023642604,
      0.06909872080084,
      0.050578965159176,
      0.0957013618213507,
      0.103330472221485,
      0.00330606055012485,
      -0.123608043285591,
      -0.325083094069447,
      0.855934285379504,
      0.627177064005249,
      2.51814497674312,
      0.325802530064156,
      1.25779760222402,
      0.012918476873481,
      0.220224954132142,
      -0.150517337454403,
      -0.365901538506057,
      -0.115719674504835,
      0,
      0,
      0}},
    {"y: 2, z: 2, torsion: 1, axial: 1",
     "chord",
     "none",
     "yes",
     "yes",
     {1.77631232332611,
      0.0737512647510011,
      0.0387198883157303,
      1.54560824607975,
      0.0695088635963527,
      0.0419428021516216,
      0.019039609960218,
      0.0459196374123248,
      -0.00317141968766848,
      -0.0472951009989247,
      -0.19810000536278,
      0.179981678612741,
      0.298289800178552,
      4.68828593947622,
      0.297173127338822,
      1.30132770939642,
      0,
      0,
      -0.189234746699125,
      0.13121070676259,
      0.077764659493508,
      0,
      0.262934788064036,
      0.542401599191515}},
    {"y: 2, z: 2, torsion: 1, axial: 1",
     "chord",
     "first",
     "yes",
     "yes",
     {1.80470510711309,   0.102282646128117,  0.0902393753714135, 1.59940360997029,     0.0645465209149799,
      0.0397497692794373, 0.0443420418643915, 0.0944066836151926, -0.00134535570934324, -0.048751924520564,
      -0.385346905209624, 0.0111886579040647, 0.298289800178552,  4.68828593947622,     0.297173127338822,
      1.32509174514653,   0.0199331629658727, 0.0481888553960508, -0.185173439946824,   0.107968898481868,
      0.0744485858914405, 0.0713081247645076, 0.262934788064036,  0.542401599191515}},
    {"y: 2, z: 2, torsion: 1, axial: 1",
     "chord",
     "full",
     "yes",
     "yes",
     {1.80470510711309,   0.102282646128117,  0.0902393753714135, 1.59994052244863,     0.0657382123230269,
      0.0439851175421612, 0.0452046006170358, 0.0960522184078063, 0.000759689315915083, -0.037704705731666,
      -0.429764850236579, 0.0332784903102929, 0.437770867891484,  4.68828593947622,     0.297173127338822,
      1.32509174514653,   0.0199331629658727, 0.0481888553960508, -0.185173439946824,   0.107968898481868,
      0.0744485858914405, 0.0713081247645076, 0.262934788064036,  0.542401599191515}},
};

typedef struct state {
    const kmp_flexible *flexible;
    int n, all;
    double q[MOST], rate[MOST], z[MOST + 90], zd[MOST + 90];
} state;

static double entry(const kmp_number *matrix, int n, int i, int j)
{
    return matrix[n * i + j].value;
}

/* x' A y */
static double form(const kmp_number *matrix, int n, const double *x, const double *y)
{
    double sum = 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            sum += x[i] * entry(matrix, n, i, j) * y[j];
    return sum;
}

static state state_of(const kmp_flexible *flexible)
{
    state s = {.flexible = flexible, .n = flexible->count, .all = flexible->count + flexible->quadratic_count};
    CHECK(s.n <= MOST && flexible->quadratic_count <= 90);
    for (int k = 0; k < s.n; k++) {
        s.q[k] = s.z[k] = 0.3 * cos(1 + 2 * k);
        s.rate[k] = s.zd[k] = sin(0.5 + k);
    }
    for (int j = 0; j < flexible->quadratic_count; j++) {
        const kmp_number *e = flexible->quadratic + (ptrdiff_t)j * s.n * s.n;
        s.z[s.n + j] = form(e, s.n, s.q, s.q) / 2;
        s.zd[s.n + j] = form(e, s.n, s.q, s.rate);
    }
    return s;
}

static const kmp_number *product(const state *s, int k, int l)
{
    return s->flexible->by_field + 9 * ((ptrdiff_t)s->all * k + l);
}

static void moments(const state *s, double value[VALUES])
{
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    const kmp_flexible *f = s->flexible;
    double p[3][3] = {{0}}, turning[3][3] = {{0}};
    for (int k = 0; k < s->all; k++)
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++) {
                double z = f->by_place[9 * k + 3 * a + b].value;
                p[a][b] += s->z[k] * z;
                p[b][a] += s->z[k] * z;
                for (int l = 0; l < s->all; l++) {
                    double t = product(s, k, l)[3 * a + b].value;
                    CHECK_NEAR(t, product(s, l, k)[3 * b + a].value, 0);
                    z += t * s->z[l];
                    p[a][b] += s->z[k] * t * s->z[l];
                }
                turning[a][b] += s->zd[k] * z;
            }
    for (int a = 0; a < 3; a++) {
        value[a] = f->moment[a].value;
        for (int k = 0; k < s->all; k++)
            value[a] += f->field[3 * k + a].value * s->z[k];
        value[9 + a] = turning[(a + 2) % 3][(a + 1) % 3] - turning[(a + 1) % 3][(a + 2) % 3];
    }
    for (int k = 0; k < 6; k++)
        value[3 + k] = f->second[k].value + p[row[k]][column[k]];
}

static void energies(const state *s, double value[VALUES])
{
    for (int k = 0; k < s->all; k++)
        for (int l = 0; l < s->all; l++)
            for (int a = 0; a < 3; a++)
                value[12] += s->zd[k] * product(s, k, l)[4 * a].value * s->zd[l] / 2;
    value[13] = form(s->flexible->stiffness, s->n, s->q, s->q) / 2;
    value[14] = form(s->flexible->damping, s->n, s->rate, s->rate);
}

static double at_station(const state *s, const kmp_number *first, const kmp_number *more, int c)
{
    double sum = form(more + (ptrdiff_t)c * s->n * s->n, s->n, s->q, s->q) / 2;
    for (int k = 0; k < s->n; k++)
        sum += first[c * s->n + k].value * s->q[k];
    return sum;
}

static void stations(const kempe_model *model, const state *s, double value[VALUES])
{
    const kmp_station *all = s->flexible->stations, *end = &all[model->points[0].station - 1],
                      *between = &all[model->points[1].station - 1];
    for (int c = 0; c < 3; c++) {
        value[15 + c] = end->at[c].value + at_station(s, end->shift, end->shift_more, c);
        value[18 + c] = at_station(s, between->turn, between->turn_more, c);
        value[21 + c] = at_station(s, all->turn, all->turn_more, c);
        CHECK_NEAR(all->at[c].value + at_station(s, all->shift, all->shift_more, c), 0, 0);
    }
}

static void compare(const known *row)
{
    char text[1024];
    double value[VALUES] = {0};
    (void)snprintf(
        text, sizeof text,
        "kempe: 1\nbodies:\n  rod:\n    joint: {revolute: z, at: ground}\n    flexible:\n"
        "      beam: {length: 1.3, rhoA: 2.1, EIz: 7, EIy: 5, GJ: 3, EA: 90, kGA: [60, 40], rhoI: [0.03, 0.05]}\n"
        "      shapes: {%s}\n      frame: %s\n      stiffening: %s\n      rotary: %s\n      shear: %s\n"
        "      damping: {rayleigh: [0.1, 0.002]}\n      raw: yes\n"
        "    points: {end: {station: 1300 mm}, between: {station: 0.9}}\n",
        row->shapes, row->frame, row->stiffening, row->rotary, row->shear);
    kempe_model *model = read_text(text);
    if (!model)
        return;
    const state s = state_of(&model->flexibles[0]);
    moments(&s, value);
    energies(&s, value);
    stations(model, &s, value);
    for (int k = 0; k < VALUES; k++)
        if (!(fabs(value[k] - row->value[k]) <= 2e-13 * check_max(fabs(row->value[k]), 0.1))) {
            printf("  shapes %s, %s, %s, value %d\n", row->shapes, row->frame, row->stiffening, k);
            CHECK_NEAR(value[k], row->value[k], 0);
        }
    kempe_model_free(model);
}

static void digits_of_another_program(void)
{
    for (size_t k = 0; k < sizeof table / sizeof *table; k++)
        compare(&table[k]);
}

/* -- exact values -------------------------------------------------------------------------------------- */

static kempe_model *read_beam(const char *beam, const char *shapes, const char *more)
{
    char text[1024];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\nparameters: {L: 0.7, E: 70 GPa, rho: 2700, b: 30 mm}\nbodies:\n  rod:\n"
                   "    joint: {revolute: z, at: ground}\n    flexible:\n      beam: {%s}\n      shapes: {%s}\n%s"
                   "    points: {end: {station: L}}\n",
                   beam, shapes, more);
    return read_text(text);
}

static double mass(const kmp_flexible *f, int k)
{
    const kmp_number *t = f->by_field + 9 * ((ptrdiff_t)(f->count + f->quadratic_count) * k + k);
    return t[0].value + t[4].value + t[8].value;
}

/* Of modes; `family` begins at coordinate k. */
static void check_frequency(const kmp_flexible *f, int k, double expected, double tolerance)
{
    CHECK_NEAR(sqrt(entry(f->stiffness, f->count, k, k) / mass(f, k)) / expected, 1, tolerance);
}

static const char section[] = "length: L, young: E, poisson: 0.3, density: rho, section: {rectangle: [b, 12 mm]}";

static void frequencies(void)
{
    const double length = 0.7, line = 2700 * 0.03 * 0.012, bending = 70e9 * 0.012 * pow(0.03, 3) / 12, pi = acos(-1);
    const double root[] = {1.87510406871196, 4.69409113297417, 7.85475743823761};
    const double scale = sqrt(bending / line) / (length * length);
    kempe_model *clamped = read_beam(section, "y: 12, torsion: 8, axial: 12", "");
    kempe_model *chord = read_beam(section, "y: 12", "      frame: chord\n");
    kempe_model *short_one = read_beam(section, "y: 12", "      frame: chord\n      shear: yes\n      rotary: yes\n");
    for (int k = 0; k < 3 && clamped && chord && short_one; k++) {
        const double half = k + 0.5, shear = 70e9 / 2.6 * 10 * 1.3 / (12 + 11 * 0.3) * 0.03 * 0.012;
        check_frequency(clamped->flexibles, 20 + k, half * pi / length * sqrt(70e9 / 2700), 1e-6);
        check_frequency(chord->flexibles, k, (k + 1) * (k + 1) * pi * pi * scale, k == 0 ? 1e-9 : 1e-6);
        /* Timoshenko's equation of a pinned beam */
        const double u = pow((k + 1) * pi / length, 2), about = line * 0.03 * 0.03 / 12;
        const double a = line * about / shear, c = bending * u * u;
        const double d = line + u * (about + bending * line / shear);
        check_frequency(short_one->flexibles, k, sqrt((d - sqrt(d * d - 4 * a * c)) / (2 * a)), 2e-4);
    }
    kempe_model *thin = read_beam("length: L, rhoA: rho*1 kg/m^3*b*12 mm, EIz: E*b^3*1 mm", "y: 12", "");
    for (int k = 0; k < 3 && thin; k++)
        check_frequency(thin->flexibles, k, root[k] * root[k] * sqrt(70e9 * 27e-9 / line) / (length * length), 1e-7);
    kempe_model_free(clamped);
    kempe_model_free(chord);
    kempe_model_free(short_one);
    kempe_model_free(thin);
}

/* A force at the end of a cantilever: L^3/3EI, and L/kGA by shear; in the other plane too. */
static void compliances(void)
{
    const double shear = 70e9 / 2.6 * 10 * 1.3 / (12 + 11 * 0.3) * 0.03 * 0.012;
    kempe_model *m = read_beam(section, "y: 2, z: 3", "      shear: yes\n");
    const kmp_flexible *f = m ? m->flexibles : NULL;
    for (int plane = 0; plane < 2 && f; plane++) {
        const double thick = plane ? 0.012 : 0.03, wide = plane ? 0.03 : 0.012;
        double sum = 0;
        for (int k = 2 * plane; k < 2 + 3 * plane; k++) {
            double way = f->stations[1].shift[f->count * (1 + plane) + k].value;
            sum += way * way / entry(f->stiffness, f->count, k, k);
        }
        CHECK_NEAR(sum / (pow(0.7, 3) / (3 * 70e9 * wide * pow(thick, 3) / 12) + 0.7 / shear), 1, 1e-12);
    }
    kempe_model_free(m);
}

/* Sections: Timoshenko and Goodier 1970, table of section 109, of rectangles; a tube and a circle. */
static void cross_sections(void)
{
    static const double ratio[] = {1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 10},
                        part[] = {0.1406, 0.166, 0.196, 0.229, 0.249, 0.263, 0.281, 0.291, 0.312};
    for (int k = 0; k < 9; k++)
        for (int side = 0; side < 2; side++) {
            char text[256];
            (void)snprintf(text, sizeof text,
                           "length: L, young: 2, shear: 1, density: 1, section: {rectangle: [%.3g, %.3g]}",
                           side ? 1 : ratio[k], side ? ratio[k] : 1);
            kempe_model *m = read_beam(text, "torsion: 1", "      raw: yes\n");
            if (m)
                CHECK_NEAR(m->flexibles->stiffness->value * 0.7 / ratio[k], part[k], 6e-4);
            kempe_model_free(m);
        }
    kempe_model *tube = read_beam("length: L, young: 3, poisson: 0.5, density: 1, section: {tube: [2, 1]}",
                                  "torsion: 1, y: 1", "      raw: yes\n");
    kempe_model *circle =
        read_beam("length: L, young: 3, shear: 1, density: 1, section: {circle: 2}", "torsion: 1", "      raw: yes\n");
    const double pi = acos(-1), disc = pi / 2;
    if (tube && circle) {
        CHECK_NEAR(tube->flexibles->stiffness[3].value * 0.7, disc - pi / 32, 1e-14);
        CHECK_NEAR(tube->flexibles->stiffness[0].value * pow(0.7, 3) / 12, (disc - pi / 32) / 2, 1e-14);
        CHECK_NEAR(circle->flexibles->stiffness->value * 0.7, disc, 1e-14);
        CHECK_NEAR(circle->flexibles->mass->value, 0.7 * pi, 1e-14);
    }
    kempe_model_free(tube);
    kempe_model_free(circle);
}

/* -- modes --------------------------------------------------------------------------------------------- */

/* Nothing between modes; largest deflection 1. */
static void modes_of_a_span(void)
{
    static const char *const more[] = {"", "      frame: chord\n", "      shear: yes\n",
                                       "      frame: chord\n      shear: yes\n      damping: {ratio: 0.02}\n"};
    for (int i = 0; i < 4; i++) {
        kempe_model *m =
            read_beam("length: 0.7, young: 70 GPa, poisson: 0.3, density: 2700, section: {rectangle: [30 mm, 12 mm]}",
                      "y: 12, z: 3, torsion: 4, axial: 2", more[i]);
        const kmp_flexible *f = m ? m->flexibles : NULL;
        for (int k = 0; f && k < f->count; k++)
            for (int l = 0; l < f->count; l++) {
                const kmp_number *t = f->by_field + 9 * ((ptrdiff_t)(f->count + f->quadratic_count) * k + l);
                if (k == l)
                    continue;
                CHECK(t[0].value + t[4].value + t[8].value == 0);
                CHECK(entry(f->stiffness, f->count, k, l) == 0 && entry(f->damping, f->count, k, l) == 0);
            }
        for (int k = 0; f && k < f->count; k++) {
            const double critical = 2 * sqrt(entry(f->stiffness, f->count, k, k) * mass(f, k));
            CHECK_NEAR(entry(f->damping, f->count, k, k) / critical, i == 3 ? 0.02 : 0, 1e-14);
            CHECK((k > 0 && k < 12 ? entry(f->stiffness, f->count, k - 1, k - 1) / mass(f, k - 1) : 0) <
                  entry(f->stiffness, f->count, k, k) / mass(f, k));
        }
        if (f && i % 2 == 0)
            CHECK_NEAR(f->stations[1].shift[f->count].value, 1, 1e-12);
        kempe_model_free(m);
    }
}

/* The same ratio by monomials: D = 2 ratio M sqrt(M^-1 K). */
static void damping_of_monomials(void)
{
    kempe_model *m = read_beam(section, "y: 3", "      raw: yes\n      damping: {ratio: 0.02}\n");
    const kmp_flexible *f = m ? m->flexibles : NULL;
    double d[9], k[9], mass_of[9], half[9], twice[9];
    for (int i = 0; f && i < 9; i++) {
        const kmp_number *t = f->by_field + 9 * ((ptrdiff_t)(f->count + f->quadratic_count) * (i / 3) + i % 3);
        mass_of[i] = t[0].value + t[4].value + t[8].value;
        d[i] = f->damping[i].value;
        k[i] = f->stiffness[i].value;
    }
    /* D M^-1 D = 4 ratio^2 K, with M^-1 D by Gauss */
    memcpy(half, d, sizeof half);
    for (int i = 0; f && i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double factor = mass_of[3 * j + i] / mass_of[3 * i + i];
            for (int c = 0; c < 3 && j != i; c++) {
                mass_of[3 * j + c] -= factor * mass_of[3 * i + c];
                half[3 * j + c] -= factor * half[3 * i + c];
            }
        }
    for (int i = 0; f && i < 9; i++) {
        twice[i] = 0;
        for (int c = 0; c < 3; c++)
            twice[i] += d[3 * (i / 3) + c] * half[3 * c + i % 3] / mass_of[4 * c];
        CHECK_NEAR(twice[i] / (4 * 0.02 * 0.02 * k[i]), 1, 1e-9);
    }
    kempe_model_free(m);
}

/* -- parameters ---------------------------------------------------------------------------------------- */

/* Numbers of an instance with other values, beside the model read with these. */
static void other_values(void)
{
    static const char *const names[] = {"L", "E", "rho", "b"};
    static const double values[] = {0.9, 50e9, 3100, 0.02};
    static const kempe_setting set[] = {{"L", "0.9"}, {"E", "50e9"}, {"rho", "3100"}, {"b", "0.02"}};
    static const char *const more[] = {
        "      raw: yes\n      shear: yes\n      damping: {rayleigh: [E/(70 GPa*1 s), 1 us]}\n",
        "      raw: yes\n      frame: chord\n      shear: yes\n", "      frame: chord\n"};
    static const char *const shapes[] = {"y: 2, z: 1, torsion: 2, axial: 1", "y: 3, z: 2", "y: 3"};
    for (int i = 0; i < 3; i++) {
        char text[1024];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nparameters: {L: 0.7, E: 70 GPa, rho: 2700, b: 30 mm}\nbodies:\n  rod:\n"
                       "    joint: {revolute: z, at: ground}\n    flexible:\n      beam: {%s}\n      shapes: {%s}\n%s"
                       "    points: {end: {station: L}, third: {station: L/3, offset: [0, b, 0]}}\n",
                       section, shapes[i], more[i]);
        kempe_model *nominal = read_text(text), *with = NULL, *instance = NULL;
        CHECK(kempe_model_read_text_set(context, text, "beam.yaml", set, 4, &with) == KEMPE_OK);
        CHECK(nominal && kmp_variant_instance(nominal, 4, names, values, &instance) == KEMPE_OK);
        if (with && instance) {
            const kmp_flexible *a = instance->flexibles, *b = with->flexibles;
            CHECK(a->number_count == b->number_count && a->stations != nominal->flexibles->stations);
            for (int k = 0; k < a->number_count; k++)
                CHECK(fabs(a->numbers[k].value - b->numbers[k].value) <= 1e-13 + 1e-11 * fabs(b->numbers[k].value));
            CHECK(a->mass->value == a->numbers[1].value && a->mass->value != nominal->flexibles->mass->value);
            CHECK_NEAR(instance->points[1].at[0].value, 0.3, 1e-15);
            CHECK_NEAR(instance->points[1].offset[1].value, 0.02, 1e-15);
        }
        kempe_model_free(instance);
        kempe_model_free(with);
        kempe_model_free(nominal);
    }
}

static void impossible_values(void)
{
    static const char *const names[] = {"L"};
    kempe_model *m = read_text("kempe: 1\nparameters: {L: 0.7}\nbodies:\n  rod:\n    joint: {revolute: z, at: ground}\n"
                               "    flexible: {beam: {length: L, rhoA: 1, EIz: 1}, shapes: {y: 1}}\n"
                               "    points: {P: {station: 0.6}}\n"),
                *instance = NULL;
    CHECK(m && kmp_variant_instance(m, 1, names, (const double[]){0.5}, &instance) != KEMPE_OK && !instance);
    CHECK_TEXT(kempe_context_message(context),
               "a station of flexible body 'rod' is at 0.6 m, and its beam is 0.5 m long");
    CHECK(m && kmp_variant_instance(m, 1, names, (const double[]){-1}, &instance) != KEMPE_OK && !instance);
    kempe_model_free(m);
}

/* -- what is zero, and where things are ---------------------------------------------------------------- */

/* A plane beam of the first order has two quadratic functions; stations of one place are one. */
static void small_models(void)
{
    kempe_model *m =
        read_text("kempe: 1\nbodies:\n  rod:\n    joint: {revolute: z, at: ground}\n"
                  "    flexible: {beam: {length: 0.5, rhoA: 1, EIz: 1}, shapes: {y: 3}, frame: chord}\n"
                  "    points: {A: {station: 0}, B: {station: 500 mm}, C: {station: 0.5, offset: [0, 1 mm, 0]},"
                  " D: {station: 0.2}}\n");
    if (!m)
        return;
    const kmp_flexible *f = m->flexibles;
    int count = 0;
    for (int k = 0; k < f->number_count; k++)
        count += f->numbers[k].value != 0;
    CHECK(f->quadratic_count == 2 && f->station_count == 3 && f->moved);
    CHECK(m->points[0].station == 1 && m->points[1].station == 2 && m->points[2].station == 2 &&
          m->points[3].station == 3);
    /* three shapes alone have 54 products, 27 in either quadratic function, 9 stiffnesses */
    printf("  %d of %d numbers are not zero\n", count, f->number_count);
    CHECK(count < 80);
    CHECK(m->motion_count == 4 && m->motions[3].elastic && !m->motions[3].rotation && m->motions[3].body == 1);
    CHECK_TEXT(m->motions[3].name, "rod.y3");
    kempe_model_free(m);
}

/* Quadratic functions of the whole second order: of the axis as many as its displacements are independent, which are at
 * most the pairs of shapes; of turned sections six moments. */
static void functions_of_second_order(void)
{
    static const struct {
        const char *shapes, *frame;
        int count;
    } row[] = {{"y: 1", "clamped", 1},     {"y: 2", "chord", 3},
               {"y: 3", "clamped", 5},     {"y: 3", "chord", 6},
               {"y: 1, z: 1", "chord", 1}, {"y: 2, z: 2, torsion: 1", "clamped", 3 + 2 + 2 + 6}};
    for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
        char more[128];
        (void)snprintf(more, sizeof more, "      frame: %s\n      stiffening: full\n", row[k].frame);
        kempe_model *m = read_beam(section, row[k].shapes, more);
        if (m && m->flexibles->quadratic_count != row[k].count)
            printf("  %s: %d\n", row[k].shapes, m->flexibles->quadratic_count);
        CHECK(m && m->flexibles->quadratic_count == row[k].count);
        kempe_model_free(m);
    }
}

/* A body on the end of a deformed rod, in the frame of the chord. */
static void poses(void)
{
    kempe_model *m = read_text(
        "kempe: 1\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n"
        "    flexible: {beam: {length: 2, rhoA: 1, EIz: 1}, shapes: {y: 1}, frame: chord, raw: yes}\n"
        "    points: {B: {station: 2, offset: [0, 0.5, 0]}}\n"
        "  tool: {joint: {name: T, revolute: z, at: rod.B}, mass: 1, inertia: {zz: 1}, points: {P: [1, 0, 0]}}\n");
    if (!m)
        return;
    /* v = xi (1 - xi) q: slopes q/2 and -q/2; the chord is shorter by q^2/12 */
    const double q[3] = {0.7, 0.2, 0.1}, chord = 0.65, end = 0.6, tool = 0.8, length = 2 - 0.01 / 12;
    const double x = length * cos(chord) - 0.5 * sin(end), y = length * sin(chord) + 0.5 * cos(end);
    kmp_pose pose[3], at[2];
    kmp_pose_all(m, q, pose);
    for (int k = 0; k < 2; k++)
        kmp_pose_of_point(m, pose, q, k, &at[k]);
    CHECK_NEAR(atan2(pose[1].r[1][0], pose[1].r[0][0]), chord, 1e-15);
    CHECK_NEAR(atan2(at[0].r[1][0], at[0].r[0][0]), end, 1e-15);
    CHECK_NEAR(at[0].p[0], x, 1e-15);
    CHECK_NEAR(at[0].p[1], y, 1e-15);
    CHECK_NEAR(at[1].p[0], x + cos(tool), 1e-15);
    CHECK_NEAR(at[1].p[1], y + sin(tool), 1e-15);
    kempe_model_free(m);
}

/* A loop whose start values would else make the tree through the far end. */
static void the_joint_at_the_far_end_is_cut(void)
{
    kempe_model *m =
        read_text("kempe: 1\nground: {points: {O: [0, 0, 0], Q: [0.5, 0, 0]}}\nbodies:\n"
                  "  crank: {mass: 1, inertia: {zz: 1}, points: {A: [0, 0, 0], B: [0.2, 0, 0]}}\n"
                  "  rod:\n    flexible: {beam: {length: 0.5, rhoA: 1, EIz: 6}, shapes: {y: 2}, frame: chord}\n"
                  "    points: {B: {station: 0 mm}, C: {station: 0.5}}\n"
                  "  rocker: {mass: 1, inertia: {zz: 1}, points: {C: [0.3, 0, 0], D: [0, 0, 0]}}\n"
                  "joints:\n  A: {revolute: [ground.O, crank.A]}\n  B: {revolute: [crank.B, rod.B]}\n"
                  "  C: {revolute: [rod.C, rocker.C]}\n  D: {revolute: [ground.Q, rocker.D]}\n"
                  "sensors: {s: q(rod.y2)*qd(rod.y1) + q(A)}\nstart: {q: {D: 60 deg, C: 20 deg, rod.y1: 1 mm}}\n");
    CHECK(m && m->cut_count == 1);
    if (m)
        CHECK_TEXT(m->cuts[0].joint, "C");
    if (m)
        CHECK_TEXT(m->cuts[0].why, "it does not hold the flexible body at its origin");
    if (m && m->sensor_count == 1) {
        const kmp_expr *factors = m->sensors[0].expr->a;
        CHECK(factors->a->index == 4 && factors->b->kind == KMP_EXPR_QD && factors->b->index == 3);
        CHECK(m->start.q[3].value == 0.001);
    }
    kempe_model_free(m);
}

int main(void)
{
    context = kempe_context_new();
    TEST(digits_of_another_program);
    TEST(frequencies);
    TEST(compliances);
    TEST(cross_sections);
    TEST(modes_of_a_span);
    TEST(damping_of_monomials);
    TEST(other_values);
    TEST(impossible_values);
    TEST(small_models);
    TEST(functions_of_second_order);
    TEST(poses);
    TEST(the_joint_at_the_far_end_is_cut);
    kempe_context_free(context);
    return check_report();
}
