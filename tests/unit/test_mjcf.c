/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* Models in MJCF: one file with all elements is the same model as one in Kempe's language; ways to write one
 * orientation; included files; what is refused, and what is named because it is not used. MuJoCo's numbers:
 * tests/oracle/robots. */
#include "base/context.h"
#include "foreign_models.h"
#include <kempe/settings.h>
#include <kempe/table.h>
#include <math.h>

#define OWN KEMPE_ROOT "/tests/models/tied_gripper"

static kempe_context *context;

static void same_in_both_languages(void)
{
    CHECK(kempe_context_set_left_out(context, "armature") == KEMPE_OK); /* of a ball joint */
    foreign_same(context, OWN ".mjcf", OWN ".yaml");
}

#define HEAD  "<mujoco><worldbody>"
#define HINGE "<joint name='j'/><inertial mass='1' pos='0.1 0 0' diaginertia='1 2 3'/></body></worldbody></mujoco>"

static char *shown(const char *text)
{
    kempe_model *model = NULL;
    char *out = NULL;
    if (kempe_model_read_text(context, text, "m.mjcf", &model) == KEMPE_OK)
        CHECK(kempe_model_print(model, KEMPE_TEXT, &out) == KEMPE_OK);
    else
        printf("%s\n", kempe_context_message(context));
    kempe_model_free(model);
    return out;
}

static void all_the_same(int count, const char *const *texts)
{
    char *first = shown(texts[0]);
    for (int k = 1; k < count; k++) {
        char *other = shown(texts[k]);
        CHECK(first && other);
        if (first && other)
            CHECK_TEXT(other, first);
        kempe_text_free(other);
    }
    kempe_text_free(first);
}

/* x to y, y to z, z to x: a third of a turn about (1, 1, 1). Rz(90) Rx(90), turned axes, is that. */
static void ways_to_write_an_orientation(void)
{
    static const char *const texts[] = {
        HEAD "<body name='b' quat='1 1 1 1'>" HINGE,
        HEAD "<body name='b' quat='-5 -5 -5 -5'>" HINGE,
        HEAD "<body name='b' axisangle='2 2 2 120'>" HINGE,
        HEAD "<body name='b' xyaxes='0 3 0 0 1 1'>" HINGE,
        HEAD "<body name='b' euler='90 0 90'>" HINGE, /* replaced below */
        "<mujoco><compiler eulerseq='zyx'/><worldbody><body name='b' euler='90 0 90'>" HINGE,
        "<mujoco><compiler eulerseq='XYZ'/><worldbody><body name='b' euler='90 0 90'>" HINGE,
        "<mujoco><compiler angle='radian' eulerseq='zxz'/><worldbody>"
        "<body name='b' euler='1.5707963267948966 1.5707963267948966 0'>" HINGE,
        HEAD "<frame euler='0 0 90'><frame euler='90 0 0'><body name='b'>"
             "<joint name='j'/><inertial mass='1' pos='0.1 0 0' diaginertia='1 2 3'/></body></frame></frame>"
             "</worldbody></mujoco>",
    };
    static const char *const others[] = {HEAD "<body name='b' zaxis='0 -3 0'>" HINGE,
                                         HEAD "<body name='b' euler='90 0 0'>" HINGE,
                                         HEAD "<body name='b' axisangle='1 0 0 90'>" HINGE};
    const char *used[9];
    memcpy(used, texts, sizeof used);
    used[4] = texts[0];
    all_the_same(9, used);
    all_the_same(3, others);
}

/* Attributes come from the nearest class; of a list of numbers those that are given. */
static void classes_of_defaults(void)
{
    static const char *const texts[] = {
        "<mujoco><worldbody><body name='b'><joint name='j' damping='2' axis='1 0 0'/>"
        "<geom type='box' size='0.1 0.2 0.3' density='5'/></body></worldbody></mujoco>",
        "<mujoco><default><joint damping='2'/><geom density='5' size='1 0.2 0.3'/><default class='c'>"
        "<joint axis='1 0 0'/><geom type='box'/></default></default><worldbody><body name='b' childclass='c'>"
        "<joint name='j'/><geom size='0.1'/></body></worldbody></mujoco>",
        "<mujoco><default class='all'><joint damping='7'/><default class='c'><joint damping='2'/></default></default>"
        "<worldbody><body name='b' childclass='all'><frame childclass='c'><joint name='j' axis='1 0 0'/>"
        "<geom type='box' size='0.1 0.2 0.3' density='5' class='all'/></frame></body></worldbody></mujoco>",
    };
    all_the_same(3, texts);
}

static void included_files(void)
{
    CHECK_TEXT(foreign_log(context, NULL, KEMPE_ROOT "/tests/models/gantry.mjcf"),
               "2 /tests/models/gantry_trolley.mjcf:2:73: 'friction' in 'geom' is not used\n");
    kempe_model *model = NULL;
    CHECK(kempe_model_read(context, KEMPE_ROOT "/tests/models/gantry_circle.mjcf", &model) == KEMPE_E_INPUT);
    CHECK_TEXT(kempe_context_message(context) + strlen(KEMPE_ROOT),
               "/tests/models/gantry_circle.mjcf:2:3: the file 'gantry_circle.mjcf' is included twice");
}

typedef struct motion {
    kempe_model *model;
    kempe_system *system;
    kempe_trajectory *run;
} motion;

/* A run of a file with inputs and parameters set; without `run` after a failed check. */
static motion set_run(const char *path, int count, const kempe_setting *set, double t_end, double rtol)
{
    const kempe_run_options options = {.t_end = t_end, .rtol = rtol};
    motion m = {NULL, NULL, NULL};
    CHECK(kempe_model_read_set(context, path, set, count, &m.model) == KEMPE_OK);
    CHECK(m.model && kempe_system_new(m.model, &m.system) == KEMPE_OK);
    CHECK(m.system && kempe_simulate(m.system, &options, &m.run) == KEMPE_OK);
    if (!m.run)
        printf("%s\n", kempe_context_message(context));
    return m;
}

static void end_motion(motion *m)
{
    kempe_trajectory_free(m->run);
    kempe_system_free(m->system);
    kempe_model_free(m->model);
}

/* The end of a run of a file with all inputs set. */
static void run_of(const char *path, double q[2])
{
    static const kempe_setting inputs[] = {{"ctrl_push", "1"},    {"ctrl_servo", "0.3"}, {"ctrl_pace", "-1"},
                                           {"ctrl_brake", "0.5"}, {"ctrl_law", "0.2"},   {"ctrl_winch", "0.7"},
                                           {"ctrl_haul", "0.4"}};
    motion m = set_run(path, 7, inputs, 2, 1e-9);
    int last = m.run ? kempe_trajectory_row_count(m.run) - 1 : -1;
    for (int k = 0; k < 2; k++)
        q[k] = last >= 0 ? kempe_trajectory_q(m.run, last)[k] : k;
    end_motion(&m);
}

/* Springs, friction and actuators of tendons; servos. The laws are those of MuJoCo, written by hand. */
static void tendons_and_actuators(void)
{
    double q[2], own[2];
    run_of(KEMPE_ROOT "/tests/models/tendons.mjcf", q);
    run_of(KEMPE_ROOT "/tests/models/tendons.yaml", own);
    CHECK(fabs(q[0] - 0.25) > 1e-3 && fabs(q[1]) > 1e-3);
    for (int k = 0; k < 2; k++)
        CHECK_NEAR(q[k], own[k], 1e-8);
}

/* Tendons over a cylinder, which they leave and meet, and a sphere, and with pulleys: lengths at states and a motion by
 * MuJoCo (tests/oracle/tendons). */
static void wrapped_tendons(void)
{
    static const double states[][4] = {
        {0, 0, 0.908381854261522, 1.05126443529228},        {0.5, 0.3, 0.956146470263503, 1.13686176521226},
        {-0.7, -1.2, 0.729665910718507, 0.847120869636755}, {-0.4, 1.1, 0.86225348468966, 0.946060837799102},
        {1.2, -0.9, 0.936972453818402, 1.12962109017772},   {0.2, 2.2, 0.808579206161385, 0.9762579186231},
        {-1, 0.8, 0.78516276167307, 0.824136428654428}};
    static const double end[4] = {-0.05703685226, -2.68940131808, -3.4402120376, 1.6215833956};
    static const char path[] = KEMPE_ROOT "/tests/models/wrapped.yaml";
    for (size_t k = 0; k < sizeof states / sizeof *states; k++) {
        char a[32], b[32];
        (void)snprintf(a, sizeof a, "%g", states[k][0]);
        (void)snprintf(b, sizeof b, "%g", states[k][1]);
        const kempe_setting set[] = {{"a", a}, {"b", b}};
        motion m = set_run(path, 2, set, 1e-6, 1e-6);
        for (int i = 0; i < 2; i++) {
            kempe_table *table = NULL;
            CHECK(m.run && kempe_trajectory_outputs(m.run, i ? "tackle" : "long", &table) == KEMPE_OK);
            CHECK_NEAR(table ? kempe_table_number(table, 0, 1) : NAN, states[k][2 + i], 1e-13);
            kempe_table_free(table);
        }
        end_motion(&m);
    }
    const kempe_setting controls[] = {{"ctrl_long", "-3"}, {"ctrl_servo", "0.4"}};
    motion m = set_run(path, 2, controls, 1, 1e-11);
    const int last = m.run ? kempe_trajectory_row_count(m.run) - 1 : -1;
    for (int k = 0; last >= 0 && k < 2; k++) {
        CHECK_NEAR(kempe_trajectory_q(m.run, last)[k], end[k], 1e-9);
        CHECK_NEAR(kempe_trajectory_qd(m.run, last)[k], end[2 + k], 1e-8);
    }
    end_motion(&m);
}

/* Mechanics that is not read is an error, unless it is left out by name; then results say so. */
static void unread_mechanics(void)
{
    static const char text[] = HEAD "<body name='b' gravcomp='0'><joint name='j'/><geom size='0.1'/></body></worldbody>"
                                    "<actuator>\n<muscle joint='j'/></actuator></mujoco>";
    kempe_model *model = NULL;
    foreign_refuse(context, "m.mjcf", text,
                   "m.mjcf:2:1: 'muscle' in 'actuator' is not used; without it the machine is another one: "
                   "--leave-out muscle allows that");
    CHECK(kempe_context_set_left_out(context, "wind,muscle") == KEMPE_OK);
    CHECK(kempe_model_read_text(context, text, "m.mjcf", &model) == KEMPE_OK);
    CHECK(kempe_context_set_left_out(context, NULL) == KEMPE_OK);
    if (!model)
        return;
    kempe_system *system = NULL;
    kempe_trajectory *run = NULL;
    CHECK(kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(kempe_simulate(system, &(kempe_run_options){.t_end = 0.1}, &run) == KEMPE_UNTRUSTED);
    char *warnings = kmp_context_warnings(context);
    CHECK(warnings && strstr(warnings, "m.mjcf:2:1: 'muscle' in 'actuator' is not used; the machine differs from"));
    kmp_free(warnings);
    kempe_trajectory_free(run);
    kempe_system_free(system);
    kempe_model_free(model);
}

#define BODY "<body name='b'>\n<joint name='j'/><geom size='0.1'/></body>"

static void refuse(const char *text, const char *sentence)
{
    foreign_refuse(context, "m.mjcf", text, sentence);
}

static void what_is_refused(void)
{
    refuse(HEAD "<body name='b'>\n<joint type='screw'/><geom size='0.1'/></body></worldbody></mujoco>",
           "m.mjcf:2:1: joint type 'screw' is unknown; available: hinge, slide, ball, free");
    refuse(HEAD "<body name='b'>\n<geom type='cone'/></body></worldbody></mujoco>",
           "m.mjcf:2:1: geom type 'cone' is unknown; available: plane, hfield, sphere, capsule, ellipsoid, cylinder, "
           "box, mesh, sdf");
    refuse(HEAD "<body name='b'><joint/>\n<geom type='mesh' mesh='hull'/></body></worldbody></mujoco>",
           "m.mjcf:2:1: the body 'b' has its mass from a mesh, and it has no file: give it an element 'inertial'");
    refuse(HEAD "<body name='b'><joint/>\n<geom size='0.1' shellinertia='true'/></body></worldbody></mujoco>",
           "m.mjcf:2:1: the body 'b' has its mass from a shell: give it an element 'inertial'");
    refuse(HEAD "<body name='b'><joint/>\n<geom type='capsule' size='0.1'/></body></worldbody></mujoco>",
           "m.mjcf:2:1: geom type 'capsule' needs more numbers in its size");
    refuse(HEAD "<body name='b'><joint/>\n<freejoint/><geom size='0.1'/></body></worldbody></mujoco>",
           "m.mjcf:2:1: the free joint of 'b' must be the only joint of a body of the world");
    refuse(HEAD "<body name='b'\nquat='1 0 0 0' euler='0 0 0'><geom size='0.1'/></body></worldbody></mujoco>",
           "m.mjcf:1:20: attribute 'quat' is a second orientation: give one");
    refuse(HEAD "<body name='b'\nquat='0 0 0 0'><geom size='0.1'/></body></worldbody></mujoco>",
           "m.mjcf:1:20: quat '0 0 0 0' gives no orientation: its length is zero, or its axes are parallel");
    refuse(HEAD "<body name='b' childclass='c'><joint/></body></worldbody></mujoco>",
           "m.mjcf:1:20: the class of defaults 'c' does not exist");
    refuse(
        HEAD BODY "\n<replicate count='3'/></worldbody></mujoco>",
        "m.mjcf:3:1: the element 'replicate' adds bodies and is not read: write them out (MuJoCo saves such a file)");
    refuse("<mujoco><compiler coordinate='global'/></mujoco>",
           "m.mjcf:1:9: coordinate 'global' is not read: MuJoCo 2.3.3 saves with 'local'");
    refuse("<mujoco><compiler eulerseq='xyw'/></mujoco>",
           "m.mjcf:1:9: eulerseq 'xyw' is not three letters of x, y, z, X, Y, Z");
    refuse(HEAD BODY "</worldbody><equality>\n<connect body1='b' body2='c' anchor='0 0 0'/></equality></mujoco>",
           "m.mjcf:3:1: the body 'c' does not exist");
    refuse(HEAD BODY "</worldbody><equality>\n<connect body1='b'/></equality></mujoco>",
           "m.mjcf:3:1: attribute 'anchor' is missing here");
    refuse(HEAD BODY "</worldbody><equality>\n<weld site1='s' site2='s'/></equality></mujoco>",
           "m.mjcf:3:1: the site 's' does not exist");
    refuse(HEAD BODY "</worldbody><equality>\n<joint joint1='k'/></equality></mujoco>",
           "m.mjcf:3:1: the joint 'k' does not exist");
    refuse(HEAD "<body name='b'><joint name='j' type='ball'/><geom size='0.1'/></body></worldbody><equality>\n"
                "<joint joint1='j'/></equality></mujoco>",
           "m.mjcf:2:1: the joint 'j' has several coordinates: one is needed here");
    refuse(HEAD BODY "</worldbody><tendon><spatial name='t'/></tendon><equality>\n<tendon tendon1='t'/></equality>"
                     "</mujoco>",
           "m.mjcf:3:1: the tendon 't' is spatial: equalities of fixed tendons are read");
}

#define WRAP                                                                                                           \
    "<mujoco><worldbody><geom name='drum' type='cylinder' size='0.1 1'/><geom name='brick' type='box' size='1 1 1'/>"  \
    "<geom name='ball' size='0.1'/><site name='a' pos='-1 0.2 0'/><site name='in' pos='0.01 0 0'/>"                    \
    "<site name='far' pos='0 -1 0'/><body name='b'><joint name='j'/><inertial mass='1' pos='0 0 0' "                   \
    "diaginertia='1 1 1'/><site name='c' pos='1 -0.1 0'/></body></worldbody><tendon><spatial name='t' stiffness='1'>"
#define WRAPPED "</spatial></tendon></mujoco>"

#define LEFT "; without it the machine is another one: --leave-out geom allows that"

static void refused_tendons(void)
{
    static const struct {
        const char *path, *words;
    } cases[] = {
        {"<site site='a'/>\n<geom geom='brick'/><site site='c'/>",
         "m.mjcf:2:1: the geom 'brick' is neither a sphere nor a cylinder, around which a tendon lies"},
        {"<site site='a'/>\n<geom geom='cone'/><site site='c'/>", "m.mjcf:2:1: the geom 'cone' does not exist"},
        {"<site site='a'/>\n<geom geom='drum' sidesite='in'/><site site='c'/>",
         "m.mjcf:2:1: the geom 'drum' has its sidesite inside: tendons inside geoms are not read" LEFT},
        {"<site site='a'/>\n<geom geom='ball' sidesite='far'/><site site='c'/>",
         "m.mjcf:2:1: the geom 'ball' has its sidesite on the far side: ropes have the shortest way over a "
         "sphere" LEFT},
        {"<site site='in'/>\n<geom geom='drum'/><site site='c'/>",
         "m.mjcf:2:1: the geom 'drum' has a neighbour of the tendon inside" LEFT},
        {"\n<geom geom='drum'/><site site='c'/>", "m.mjcf:2:1: the geom 'drum' has no site before it"},
        {"<site site='a'/><site site='c'/>\n<pulley divisor='0'/><site site='a'/><site site='c'/>",
         "m.mjcf:2:1: the divisor of tendon 't' is not positive"},
        {"<site site='a'/><site site='c'/><pulley divisor='2'/><site site='a'/>",
         "m.mjcf:1:378: the part 't_path_2' of a tendon does not go from a site to a site"}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[2048];
        (void)snprintf(text, sizeof text, "%s%s%s", WRAP, cases[k].path, WRAPPED);
        refuse(text, cases[k].words);
    }
}

#define ACTED(defaults, actuator)                                                                                      \
    "<mujoco><default>" defaults "</default><worldbody><body name='b'><joint name='j'/><inertial mass='1' pos='0 0 "   \
    "0' diaginertia='1 2 3'/></body></worldbody><actuator>\n" actuator "</actuator></mujoco>"

/* All actuators share one set of defaults, whatever their words; of one file the last one takes effect last. The laws
 * are those of MuJoCo 4.0. */
static void defaults_of_actuators(void)
{
    static const char *const cases[][2] = {
        {ACTED("<general gainprm='7'/>", "<position name='u' joint='j'/>"),
         ACTED("", "<position name='u' joint='j' kp='7'/>")},
        {ACTED("<general gainprm='7'/>", "<velocity name='u' joint='j'/>"),
         ACTED("", "<velocity name='u' joint='j' kv='7'/>")},
        {ACTED("<position kp='50' kv='2'/>", "<general name='u' joint='j'/>"),
         ACTED("", "<general name='u' joint='j' gainprm='50' biastype='affine' biasprm='0 -50 -2'/>")},
        {ACTED("<position kp='50'/><motor gear='2'/>", "<position name='u' joint='j'/>"),
         ACTED("", "<position name='u' joint='j' gear='2'/>")},
        {ACTED("<motor gear='2'/><position gear='3'/>", "<motor name='u' joint='j'/>"),
         ACTED("", "<motor name='u' joint='j' gear='3'/>")},
        {ACTED("<position ctrlrange='-1 1' kp='5'/><velocity ctrlrange='-2 2'/>",
               "<position name='u' joint='j' kp='5' kv='1'/>"),
         ACTED("", "<position name='u' joint='j' kp='5' kv='1' ctrlrange='-2 2'/>")},
        {ACTED("<general gainprm='5'/><default class='c'><position kv='3'/></default>",
               "<position class='c' name='u' joint='j'/>"),
         ACTED("", "<position name='u' joint='j' kp='5' kv='3'/>")},
        {ACTED("<velocity kv='5'/>", "<damper name='u' joint='j' ctrlrange='0 1'/>"),
         ACTED("", "<damper name='u' joint='j' kv='0' ctrlrange='0 1'/>")},
        {ACTED("<damper kv='5'/>", "<damper name='u' joint='j' ctrlrange='0 1'/>"),
         ACTED("", "<damper name='u' joint='j' kv='5' ctrlrange='0 1'/>")},
        {ACTED("", "<damper name='u' joint='j' kv='5' ctrlrange='0 1'/>"),
         ACTED("</default><compiler autolimits='false'/><default class='main'>",
               "<damper name='u' joint='j' kv='5' ctrlrange='0 1'/>")},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        all_the_same(2, cases[k]);
    refuse(ACTED("<velocity kv='5'/>", "<position name='u' joint='j' kp='3'/>"),
           "m.mjcf:2:1: position 'u' is not used: its law follows from defaults of another kind of actuator, which "
           "versions of MuJoCo read differently: give it its numbers; without it the machine is another one: "
           "--leave-out position allows that");
}

/* With limits of joints the range of a tendon is two stops of its length. */
static void limits_of_tendons(void)
{
    CHECK(kempe_context_set_joint_limits(context, 1) == KEMPE_OK);
    char *text =
        shown("<mujoco><worldbody><geom name='drum' type='cylinder' size='0.1 1'/><site name='a' pos='-1 0.2 0'/>"
              "<body name='b'><joint name='j'/><inertial mass='1' pos='0 0 0' diaginertia='1 1 1'/><site name='c' "
              "pos='1 -0.1 0'/></body></worldbody><tendon><spatial name='t' range='1 2.5'><site site='a'/><geom "
              "geom='drum'/><site site='c'/></spatial></tendon></mujoco>");
    CHECK(text && strstr(text, "t_lower: "));
    CHECK(text && strstr(text, "length(t_path) - 1"));
    CHECK(text && strstr(text, "2.5 - length(t_path)"));
    kempe_text_free(text);
    CHECK(kempe_context_set_joint_limits(context, 0) == KEMPE_OK);
}

static void what_is_not_used(void)
{
    CHECK(kempe_context_set_left_out(context, "armature") == KEMPE_OK);
    CHECK_TEXT(
        foreign_log(context, NULL, OWN ".mjcf"),
        "1 /tests/models/tied_gripper.mjcf:22:7: the mass of a mesh of body 'mount' is not used: the body is fixed\n"
        "1 /tests/models/tied_gripper.mjcf:22:7: mesh 'hull.stl' is not in the picture: it is not found in the model's "
        "folder or a folder around it\n"
        "2 /tests/models/tied_gripper.mjcf:33:13: the armature of joint 'pad' with several coordinates is not used; "
        "the machine differs from the file\n"
        "1 /tests/models/tied_gripper.mjcf:4:3: 'timestep' in 'option' is not used\n"
        "1 /tests/models/tied_gripper.mjcf:17:5: 'light' in 'worldbody' is not used\n"
        "1 /tests/models/tied_gripper.mjcf:76:3: 'sensor' in 'mujoco' is not used: outputs of a run are measures of "
        "points\n"
        "2 /tests/models/tied_gripper.mjcf:27:11: limits of motion are not used: --joint-limits makes them stops\n");
    CHECK(kempe_context_set_left_out(context, NULL) == KEMPE_OK);
    foreign_strict(context, OWN ".mjcf", 2);
}

static void changed_files(void)
{
    foreign_changed(context, "m.mjcf", OWN ".mjcf");
}

int main(void)
{
    context = kempe_context_new();
    TEST(same_in_both_languages);
    TEST(ways_to_write_an_orientation);
    TEST(classes_of_defaults);
    TEST(included_files);
    TEST(tendons_and_actuators);
    TEST(wrapped_tendons);
    TEST(refused_tendons);
    TEST(defaults_of_actuators);
    TEST(limits_of_tendons);
    TEST(unread_mechanics);
    TEST(what_is_refused);
    TEST(what_is_not_used);
    TEST(changed_files);
    kempe_context_free(context);
    return check_report();
}
