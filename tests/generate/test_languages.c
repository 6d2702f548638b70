/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow not_sanitized 12 */
/* Equations written in other languages: compiled or run where their tools are, and compared with the tape at random
 * states, C to the last bit, the others to rounding. */
#include "unit/random_model.h"
/* after it: a name is in both */
#include "full.h"
#include "generate/interpreted_equations.h"
#include <kempe/generate.h>

/* -- trials ------------------------------------------------------------------------------------------ */

static void try_language(const kempe_model *model, const kempe_generate_options *g)
{
    kmp_code_source source;
    for (int s = 0; s < STATES; s++)
        for (int k = 0; k < MOST_OUT; k++)
            got[s][k] = NAN;
    CHECK(kmp_source_init(&source, model, g) == KEMPE_OK);
    int size = run_tapes(&source);
    CHECK(size > 0 && size <= MOST_OUT && source.n <= MOST);
    bool c = strcmp(g->language, "c") == 0;
    bool ran = emit(model, g);
    if (ran)
        ran = c                                    ? run_c(&source, true)
              : strcmp(g->language, "octave") == 0 ? run_octave(&source, size)
                                                   : run_python(&source, size);
    if (ran) {
        int wrong = c ? count_wrong_bits(size) : count_wrong(size);
        if (wrong)
            printf("%s in %s: %d of %d entries differ\n", source.name, g->language, wrong, STATES * size);
        CHECK(wrong == 0);
    }
    kmp_source_free(&source);
}

/* Ways: bit 0 numbers folded, bit 1 all sets as one with numbers kept, bit 2 inputs on bodies and compact names, bit 3
 * the other scheme; all four with tangents. An interpreter, which starts twice for each, takes the even ones. */
static void try_model(const kempe_model *model, const char *language, unsigned ways)
{
    static const char *const sets[2][2] = {
        {"M_C,invdyn,h_J,h_t,jdqd,qdd", "M+C+h+J+h_t+jdqd+invdyn"},
        {"M_C,invdyn,h_J,h_t,jdqd,qdd,tangents,R+R_q", "M+C+h+J+h_t+jdqd+invdyn+R+R_tangents"}};
    bool compiled = strcmp(language, "c") == 0;
    for (int way = 0; way < 4; way++) {
        if (!(ways & 1u << way) || (way % 2 && !compiled))
            continue;
        const kempe_generate_options g = {.sets = sets[ways == 15][way & 1],
                                          .drives = true,
                                          .keep_parameters = way > 0,
                                          .body_inputs = way > 1,
                                          .scheme = way == 3 ? "ner" : NULL,
                                          .language = language,
                                          .form = way == 2 ? "compact" : NULL};
        kempe_generate_options vectorised = g;
        vectorised.vectorised = true;
        try_language(model, &g);
        if (!compiled)
            try_language(model, &vectorised);
    }
}

static void try_file(const char *path, const char *language)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_read(context, path, &model) == KEMPE_OK);
    if (model)
        try_model(model, language, 6);
    kempe_model_free(model);
}

/* Names of parameters, of variables, and the comments above them. */
static void names(void)
{
    static const char text[] = "kempe: 1\nname: 2 bars */\ngravity: [0, -9.81, 0]\nparameters: {L: 0.7, none: 0}\n"
                               "bodies:\n"
                               "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [0.3, none, 0], inertia: {zz: "
                               "0.1}, points: {P: [L, 0, 0]}}\n"
                               "  b: {joint: {revolute: z, at: a.P}, mass: 2, com: [0.2, 0, 0], inertia: {zz: 0.2}}\n"
                               "forces: {s: {joint: b, spring: {stiffness: 3 N*m/rad, rest: 0.5}}}\n";
    static const char *const parameters[] = {"L",      "gravity.y",    "a.mass", "a.com.x", "a.inertia.zz",
                                             "b.mass", "b.inertia.zz", "b.com.x"};
    kempe_generate_options g = {.sets = "M_C", .keep_parameters = 1};
    kempe_model *model = NULL;
    kmp_code_source source;
    kempe_code *code = NULL;
    CHECK(kempe_model_read_text(context, text, "text", &model) == KEMPE_OK);
    if (!model) {
        printf("%s\n", kempe_context_message(context));
        return;
    }
    CHECK(kmp_source_init(&source, model, &g) == KEMPE_OK);
    CHECK_TEXT(source.name, "m_2_bars___");
    for (size_t k = 0; k < sizeof parameters / sizeof *parameters; k++) {
        bool found = false;
        for (int j = 0; j < source.parameter_count; j++)
            found = found || strcmp(source.parameter_name[j], parameters[k]) == 0;
        CHECK(found);
    }
    for (int j = 0; j < source.parameter_count; j++)
        CHECK(source.value[j] != 0 && strncmp(source.parameter_name[j], "number.", 7) != 0);
    kmp_source_free(&source);
    CHECK(kempe_code_new(model, &g, &code) == KEMPE_OK);
    const char *c = kempe_code_file_text(code, 1);
    CHECK(strstr(c, "Equations of '2 bars  /'") != NULL);
    CHECK(strstr(c, "/* link 2, angular velocity, (11) */\n    const double OM32 = qd[0] + qd[1];") != NULL);
    CHECK(strstr(c, "kempe_sincos(q[1], &S2, &C2);") != NULL);
    kempe_code_free(code);
    g.form = "compact";
    CHECK(kempe_code_new(model, &g, &code) == KEMPE_OK);
    CHECK(strstr(kempe_code_file_text(code, 1), "OM32") == NULL);
    kempe_code_free(code);
    kempe_model_free(model);
}

/* Compiled in several functions each; one of ROBOTRAN's models too, where the folder KEMPE_MBS has it. */
static void long_routines(void)
{
    const kempe_generate_options g = {.sets = "M+C+h+J+jdqd+invdyn", .keep_parameters = 1, .language = "c"};
    kempe_model *model = NULL;
    kempe_code *code = NULL;
    CHECK(kempe_model_read(context, "examples/n_four_bar/n_four_bar_40.yaml", &model) == KEMPE_OK);
    if (!model)
        return;
    CHECK(kempe_code_new(model, &g, &code) == KEMPE_OK);
    CHECK(code && strstr(kempe_code_file_text(code, 1), "_jdqd_invdyn_2(") != NULL);
    CHECK(code && strstr(kempe_code_file_text(code, 1), "double w[") != NULL);
    kempe_code_free(code);
    try_language(model, &g);
    kempe_model_free(model);
    const char *mbs = getenv("KEMPE_MBS");
    char path[512];
    snprintf(path, sizeof path, "%s/limousine63.mbs", mbs ? mbs : "");
    if (!mbs || kempe_model_read(context, path, &model) != KEMPE_OK) {
        printf("skipped: no limousine63.mbs in KEMPE_MBS\n");
        return;
    }
    try_language(model, &g);
    kempe_model_free(model);
}

/* -- what is refused --------------------------------------------------------------------------------- */

static void refuse(const kempe_model *model, kempe_generate_options g, const char *sentence)
{
    kempe_code *code = NULL;
    CHECK(kempe_code_new(model, &g, &code) == KEMPE_E_ARGUMENT && !code);
    CHECK(strstr(kempe_context_message(context), sentence) != NULL);
}

/* The friction of a contact depends on a multiplier. */
static void refuse_rubbing(void)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_read(context, "tests/models/contact_oblique.yaml", &model) == KEMPE_OK);
    if (model)
        refuse(model, (kempe_generate_options){.sets = "R_q"}, "'floor_friction1' depends on the force of its contact");
    kempe_model_free(model);
}

/* Levels of friction by another friction. */
static void refuse_text(const char *text, bool simulator, const char *sentence)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, text, "model.yaml", &model) == KEMPE_OK);
    if (model)
        refuse(model, (kempe_generate_options){.language = "c", .simulator = simulator}, sentence);
    kempe_model_free(model);
}

static void refuse_elements(void)
{
    refuse_text(
        "kempe: 1\nground: {points: {O: [0, 0, 0], Q: [1, 0.2, 0]}}\nbodies:\n"
        "  a: {joint: {prismatic: y, at: ground}, mass: 1, points: {P: [-0.1, -1, 0]}}\n"
        "  b: {joint: {prismatic: y, at: ground}, mass: 1, points: {P: [1.1, -1, 0]}}\n"
        "ropes: {r: {along: [a.P, {round: ground.O, radius: 0.1, turn: right, friction: 0.2}, {round: ground.Q, "
        "radius: 0.1, turn: right, friction: 0.1}, b.P], slack: no}}\n",
        false, "the level of 'r_friction_2' depends on the friction 'r_friction_3'");
}

static void refusals(void)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_read(context, "examples/four_bar/four_bar.yaml", &model) == KEMPE_OK);
    if (!model)
        return;
    refuse_rubbing();
    refuse_elements();
    refuse(model, (kempe_generate_options){.language = "fortran"},
           "unknown language 'fortran'; languages are c, casadi, jax, octave, python, torch");
    refuse(model, (kempe_generate_options){.form = "short"}, "unknown form 'short'");
    refuse(model, (kempe_generate_options){.language = "c", .vectorised = 1}, "c has no vectorised form");
    refuse(model, (kempe_generate_options){.sets = "M_C+K"}, "unknown set 'K'");
    refuse(model, (kempe_generate_options){.sets = "M_C+"}, "unknown set ''");
    refuse(model, (kempe_generate_options){.sets = "friction"}, "has no friction that sticks");
    refuse(model, (kempe_generate_options){.sets = "contact"}, "has no rigid contacts");
    refuse(model, (kempe_generate_options){.sets = "impact"}, "has no rigid contacts");
    refuse(model, (kempe_generate_options){.sets = "M_C+h_J+M+C+h+J+M+C+h+J+M+C+h+J+M+C+h+J+M+C"}, "fewer than 40");
    kempe_model_free(model);
}

/* A second run gives equal bytes, and a hash that the equations alone decide. */
static void hashes(void)
{
    static const char *const texts[3] = {
        "kempe: 1\nbodies: {a: {joint: {revolute: z, at: ground}, mass: 2, com: [1, 0, 0]}}\n",
        "kempe: 1\nbodies: {a: {joint: {revolute: z, at: ground}, mass: 2, com: [1, 0, 0]}}\nrun: {t_end: 7}\n",
        "kempe: 1\nbodies: {a: {joint: {revolute: z, at: ground}, mass: 2, com: [1, 1e-9, 0]}}\n"};
    kmp_code_source source[3];
    for (int k = 0; k < 3; k++) {
        kempe_model *model = NULL;
        CHECK(kempe_model_read_text(context, texts[k], "text", &model) == KEMPE_OK);
        CHECK(kmp_source_init(&source[k], model, &(kempe_generate_options){.sets = "M"}) == KEMPE_OK);
        kempe_model_free(model);
    }
    CHECK(strcmp(source[0].hash, source[1].hash) == 0 && strcmp(source[0].hash, source[2].hash) != 0);
    for (int k = 0; k < 3; k++)
        kmp_source_free(&source[k]);
}

static void same_bytes(void)
{
    static const char *const languages[] = {"c", "octave", "python", "casadi", "jax", "torch"};
    for (int k = 0; k < 6; k++) {
        const kempe_generate_options g = {
            .keep_parameters = 1, .language = languages[k], .vectorised = k == 1 || k == 2};
        kempe_code *code[2] = {NULL, NULL};
        for (int j = 0; j < 2; j++) {
            kempe_model *model = NULL;
            CHECK(kempe_model_read(context, "examples/andrews/andrews.yaml", &model) == KEMPE_OK);
            CHECK(kempe_code_new(model, &g, &code[j]) == KEMPE_OK);
            kempe_model_free(model);
        }
        CHECK(kempe_code_file_count(code[0]) == kempe_code_file_count(code[1]));
        for (int f = 0; f < kempe_code_file_count(code[0]); f++) {
            CHECK_TEXT(kempe_code_file_name(code[0], f), kempe_code_file_name(code[1], f));
            CHECK_TEXT(kempe_code_file_text(code[0], f), kempe_code_file_text(code[1], f));
        }
        kempe_code_free(code[0]);
        kempe_code_free(code[1]);
    }
}

/* -- all of it --------------------------------------------------------------------------------------- */

/* Every function of the language of expressions, inside its domain and outside, and both kinds of tables. */
static const char functions[] =
    "kempe: 1\nname: all functions\ngravity: [0, -9.81, 0]\nparameters: {T: 1 N*m, s: 1 s}\n"
    "tables:\n  lin: {x: [-1, 0, 0.5], y: [2, 1, 3], method: linear}\n"
    "  cub: {x: [-1, 0, 0.5, 2], y: [2, 1, 3, 1]}\n"
    "bodies:\n"
    "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [0.3, 0, 0], inertia: {zz: 0.1}, points: {P: [1, 0, 0]}}\n"
    "  b: {joint: {revolute: z, at: a.P}, mass: 2, com: [0.2, 0.1, 0], inertia: {zz: 0.1}}\n"
    "forces:\n"
    "  e0: {joint: a, torque: \"T*(sin(q(a))*cos(q(b)) + tan(q(a)) + sinh(q(a)) - cosh(q(b))*tanh(qd(a)*s))\"}\n"
    "  e1: {joint: a, torque: \"T*(asin(q(a)/2) + acos(q(b)/4) + atan(qd(a)*s) + atan2(qd(a)*s, q(b)) + "
    "exp(q(a)/3))\"}\n"
    "  e2: {joint: b, torque: \"T*(sqrt(q(a)) + log(q(b) + 1))\"}\n"
    "  e3: {joint: b, torque: \"T*(lin(q(a)) + cub(q(b)) + cub(qd(b)*s) + abs(q(a))*sign(qd(b)*s))\"}\n"
    "  e4: {joint: a, torque: \"T*(min(q(a), q(b)) + max(qd(a)*s, t/s) + pow(q(a)^2 + 1, q(b)) + (q(b)^2 + 1)^0.3)\"}\n"
    "  e5: {joint: a, torque: \"T*if(q(a) < q(b), log(abs(q(a)) + 1), sqrt(q(b) - 9))\"}\n";

/* A curve, whose derivatives are a table's; a screw, a weld, a coupling, a drive, a function of time. */
static const char closures[] =
    "kempe: 1\nname: kinds\ntables: {f: {x: [-9, -1, 0, 1, 3, 9], y: [1, 0, 1, 2, 1, 0]}}\n"
    "ground: {points: {O: {at: [0, 0, 0], axes: {z: [0, 1, 1]}}}}\n"
    "bodies:\n"
    "  a: {joint: {screw: z, pitch: 1 mm, at: ground.O}, mass: 1, points: {P: [1, 0, 0]}}\n"
    "  w: {joint: {weld: yes, at: a.P, frame: {x: y}}, mass: 1, points: {P: [1, 0, 0]}}\n"
    "  b: {joint: {free: x, at: w}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, points: {P: [0, 0, 0]}}\n"
    "loops:\n"
    "  F: {point_on_curve: [ground.O, b.P], table: f}\n"
    "  R: {rod: [ground.O, b.P], length: 2 + 0.1*sin(t)}\n"
    "  K: {coupler: {a.1: 1, b.2: 2}, equals: 1}\n"
    "drives: {l: {joint: b.1, locked: yes}}\n";

/* Inputs of a force and of a drive, whose derivatives are read, too; one is in no equation. */
static const char inputs[] =
    "kempe: 1\nname: given\ngravity: [0, -9.81, 0]\n"
    "inputs: {torque: {unit: N*m}, unread: {}, way: {unit: m}, gain: {t: [0, 1], value: [1, 2], method: linear}}\n"
    "bodies:\n"
    "  cart: {joint: {name: X, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
    "  load: {joint: {name: A, revolute: z, at: cart.P}, mass: 2, com: [0, -1, 0]}\n"
    "forces: {motor: {joint: A, torque: \"torque*gain - if(torque > 0, 1, 2)*q(A)\"}}\n"
    "drives: {d: {joint: X, displacement: sin(way/(1 m))*(1 m) + way}}\n";

/* States with a closed loop, blocks and samples: their rates are rows, sampled ones have the rate zero. */
static const char own_states[] =
    "kempe: 1\nname: blocks\ngravity: [0, -9.81, 0]\n"
    "states:\n"
    "  p: {start: 2, rate: 3*sin(t) - p*qd(A) + q(B)/(4 + p^2)}\n"
    "  u: {pid: 1 - q(A), proportional: 4, integral: 2, derivative: 0.3, filter: 0.1, limits: [-2, 2]}\n"
    "  y: {transfer: q(B), numerator: [1, 2, 0.5], denominator: [0.3, 1, 2]}\n"
    "  h: {hysteresis: q(A), limits: [-1, 1]}\n"
    "  s: {sample: 0.1, next: u + y}\n"
    "ground: {points: {D: [0.9, 0, 0]}}\n"
    "bodies:\n"
    "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.01}, points: {B: [0.3, 0, 0]}}\n"
    "  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, com: [0.4, 0, 0], inertia: {zz: 0.05}, points: {C: "
    "[0.8, 0, 0]}}\n"
    "  rocker: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, inertia: {zz: 0.04}, points: {C: [0.7, 0, 0]}}\n"
    "loops: {C: {ball: [rod.C, rocker.C]}}\n"
    "forces: {motor: {joint: A, torque: \"u + p*h + saturation(s, -1, 1) + y\"}}\n"
    "start: {q: {A: 90 deg, B: -62 deg, D: 106 deg}, hold: [A]}\n";

/* Friction with levels of all kinds, on a coordinate, in a tree and at a pin of a loop; sensors of accelerations. */
static const char frictions[] =
    "kempe: 1\nname: rubbing\ngravity: [0, -9.81, 0]\nparameters: {mu: 0.3}\n"
    "bodies:\n"
    "  crank: {joint: {name: th, revolute: z, at: ground}, mass: 1, com: [0.05, 0, 0], inertia: {zz: 0.01}, points: "
    "{B: "
    "[0.1, 0, 0]}}\n"
    "  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 0.6, com: [0.15, 0, 0], inertia: {zz: 0.005}, points: "
    "{P: "
    "[0.3, 0, 0]}}\n"
    "  slider: {joint: {name: x, prismatic: x, at: ground}, mass: 0.8, points: {P: [0, 0, 0]}}\n"
    "loops: {C: {ball: [rod.P, slider.P]}}\n"
    "forces:\n"
    "  guide: {joint: x, friction: {mu: mu, mu_static: 0.4, regularise: 1 mm/s}}\n"
    "  bearing: {joint: th, friction: {torque: \"if(qd(th) > 0, 1, 2)*0.1*(1 + q(th)^2)\", static: 0.4}}\n"
    "  pin: {sliding: q(th) + q(B), friction: {mu: 0.1, radius: 8 mm, reaction: C}}\n"
    "sensors: {a: \"acceleration(rod.P).x + 2*lambda(C.1)\"}\n"
    "run: {outputs: [q, sensor(a), acceleration(rod.P), velocity(rod.P), force(guide), force(pin), reaction(C), "
    "energy]}\n";

static void try_frictions(const char *language)
{
    static const char *const sets[] = {"M_C,invdyn,h_J,jdqd,qdd,friction,outputs", "M_C+h_J+jdqd+friction+outputs"};
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, frictions, "frictions", &model) == KEMPE_OK);
    for (int k = 0; model && k < 4; k++)
        if (k < 2 || strcmp(language, "c") != 0)
            try_language(model,
                         &(kempe_generate_options){
                             .sets = sets[k % 2], .keep_parameters = k % 2, .language = language, .vectorised = k > 1});
    kempe_model_free(model);
}

/* A stop in a loop, rolling on a plane, slip in two directions. */
static void try_contacts(const char *language)
{
    static const char *const paths[] = {"tests/models/contact_slider_crank.yaml", "tests/models/contact_hollow.yaml",
                                        "tests/models/contact_oblique.yaml"};
    for (int k = 0; k < 6; k++) {
        const bool vectorised = k > 2 && strcmp(language, "c") != 0;
        kempe_model *model = NULL;
        CHECK(kempe_model_read(context, paths[k % 3], &model) == KEMPE_OK);
        if (model)
            try_language(model,
                         &(kempe_generate_options){.sets = k % 3 ? "M_C,invdyn,h_J,h_t,jdqd,qdd,contact,impact,friction"
                                                                 : "M_C+h_J+jdqd,contact,impact,outputs",
                                                   .keep_parameters = k > 2,
                                                   .language = language,
                                                   .vectorised = vectorised});
        kempe_model_free(model);
    }
}

static void try_states(const char *language)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, own_states, "states", &model) == KEMPE_OK);
    for (int k = 0; model && k < 2; k++)
        if (k == 0 || strcmp(language, "c") != 0)
            try_language(model,
                         &(kempe_generate_options){
                             .sets = "M_C,discrete", .keep_parameters = k, .language = language, .vectorised = k});
    kempe_model_free(model);
}

static void try_text(const char *text, const char *language)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, text, "text", &model) == KEMPE_OK);
    if (model)
        try_model(model, language, 15);
    else
        printf("%s\n", kempe_context_message(context));
    kempe_model_free(model);
}

/* The first one whose closures can be met. */
static void try_random(const char *language)
{
    bool met = false;
    for (uint64_t seed = 1; seed < 10 && !met; seed++) {
        kempe_system *system = NULL;
        random_model r = random_model_new(seed, check_full() ? 6 : 4, MODEL_LOOPS | MODEL_FORCES | MODEL_DAMPING);
        met = r.model && kempe_system_new(r.model, &system) == KEMPE_OK;
        if (met)
            try_model(r.model, language, 15);
        kempe_system_free(system);
        random_model_free(&r);
    }
    CHECK(met);
}

static void try_all(const char *language)
{
    try_file("examples/four_bar/four_bar.yaml", language);
    try_file("examples/andrews/andrews.yaml", language);
    try_file("examples/stewart/stewart.yaml", language);
    try_file("examples/governor/governor.yaml", language);
    try_file("tests/models/measures.yaml", language);
    try_file("tests/models/lines.yaml", language);
    try_text(functions, language);
    try_text(closures, language);
    try_text(inputs, language);
    try_text(own_states, language);
    try_frictions(language);
    try_contacts(language);
    try_states(language);
    try_random(language);
    choose_states();
}

static void in_c(void)
{
    try_all("c");
}

static void in_python(void)
{
    if (python())
        try_all("python");
    else
        printf("skipped: no python3 with NumPy here\n");
}

static void in_octave(void)
{
    if (has_octave())
        try_all("octave");
    else
        printf("skipped: no octave-cli here\n");
}

int main(void)
{
    context = kempe_context_new();
    if (!mkdtemp(folder))
        return 1;
    choose_states();
    TEST(names);
    TEST(refusals);
    TEST(hashes);
    TEST(same_bytes);
    TEST(in_c);
    TEST(long_routines);
    TEST(in_python);
    TEST(in_octave);
    end_interpreters();
    char command[128];
    snprintf(command, sizeof command, "rm -r %s", folder);
    CHECK(runs(command));
    kempe_context_free(context);
    return check_report();
}
