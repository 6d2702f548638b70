/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 6 */
/* wings: exchange */
/* Models in SDFormat: one file with all elements is the same model as one in Kempe's language; frames of each version;
 * joints that close loops; what is refused, and what is named because it is not used. Drake's numbers:
 * tests/oracle/drake_models.py. */
#include "foreign_models.h"
#include "model/data/body.h"
#include <kempe/workspace.h>
#include <math.h>

#define OWN KEMPE_ROOT "/tests/models/folding_arm"

static kempe_context *context;

static void same_in_both_languages(void)
{
    foreign_same(context, OWN ".sdf", OWN ".yaml");
}

/* -- frames of versions -------------------------------------------------------------------------------- */

#define ARM                                                                                                            \
    "<model name='m'><pose>0 0 0 0 0 1.5707963267948966</pose><link name='a'><pose>0 0 0 0 0 "                         \
    "1.5707963267948966</pose>"                                                                                        \
    "<inertial><pose>0 1 0 0 0 "                                                                                       \
    "0</pose><mass>2</mass><inertia><ixx>3</ixx><iyy>5</iyy><izz>7</izz></inertia></inertial>"                         \
    "</link>"

/* The moment of inertia of link a about the axis of its joint: I + m r^2, r = 1 about x and z, 0 about y. */
static double moment(const char *version, const char *joint)
{
    char text[2000];
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_workspace *work = NULL;
    const double q = 0, qd = 0;
    double found = NAN;
    snprintf(text, sizeof text, "<sdf version='%s'>" ARM "%s</model></sdf>", version, joint);
    bool good = kempe_model_read_text(context, text, "r.sdf", &model) == KEMPE_OK &&
                kempe_system_new(model, &system) == KEMPE_OK && kempe_workspace_new(system, &work) == KEMPE_OK &&
                kempe_workspace_evaluate(work, 0, &q, &qd) == KEMPE_OK;
    if (good)
        found = kempe_workspace_mass(work)[0];
    else
        printf("%s\n", kempe_context_message(context));
    kempe_workspace_free(work);
    kempe_system_free(system);
    kempe_model_free(model);
    return found;
}

#define JOINT(inside)                                                                                                  \
    "<joint name='j' type='revolute'><parent>world</parent><child>a</child><axis>" inside "</axis></joint>"

/* The x axis of the model is the y axis of the link backwards; that of the world is the x axis of the link backwards.
 */
static void axes_of_versions(void)
{
    const double own = 3 + 2, model = 5;
    CHECK_NEAR(moment("1.4", JOINT("<xyz>1 0 0</xyz>")), model, 1e-14);
    CHECK_NEAR(moment("1.5", JOINT("<xyz>1 0 0</xyz>")), own, 1e-14);
    CHECK_NEAR(moment("1.6", JOINT("<xyz>1 0 0</xyz><use_parent_model_frame>1</use_parent_model_frame>")), model,
               1e-14);
    CHECK_NEAR(moment("1.7", JOINT("<xyz>1 0 0</xyz><use_parent_model_frame>1</use_parent_model_frame>")), own, 1e-14);
    CHECK_NEAR(moment("1.7", JOINT("<xyz expressed_in='__model__'>1 0 0</xyz>")), model, 1e-14);
    CHECK_NEAR(moment("1.11", JOINT("<xyz expressed_in='world'>0 1 0</xyz>")), model, 1e-14);
}

/* The pose of a joint is in the frame of its child, or in the one that it names. */
static void poses_of_joints(void)
{
#define AT(pose)                                                                                                       \
    "<joint name='j' type='revolute'>" pose                                                                            \
    "<parent>world</parent><child>a</child><axis><xyz>0 0 1</xyz></axis></joint>"
    CHECK_NEAR(moment("1.6", AT("<pose>0 1 0 0 0 0</pose>")), 7, 1e-14);
    CHECK_NEAR(moment("1.6", AT("<pose frame='m2'>0 0 0 0 0 0</pose>") "<frame name='m2'><pose frame='a'>0 3 0 0 0 "
                                                                       "0</pose></frame>"),
               7 + 2 * 4, 1e-14);
    CHECK_NEAR(moment("1.9", AT("<pose relative_to='__model__'>-1 0 0 0 0 0</pose>")), 7, 1e-14);
    CHECK_NEAR(moment("1.9", AT("<pose relative_to='f'/>") "<frame name='f' attached_to='a'><pose degrees='1'>0 1 0 0 "
                                                           "0 30</pose></frame>"),
               7, 1e-14);
}

/* -- loops --------------------------------------------------------------------------------------------- */

/* A closed chain of four hinges with dampers: every coordinate is needed, and a weld is cut; three of its rows
 * are zero in the plane. */
static void damped_loop(void)
{
#define LINK(name, pose) "<link name='" name "'><pose>" pose " 0 0 0 0</pose></link>"
#define HINGE(name, parent, child, pose)                                                                               \
    "<joint name='" name "' type='revolute'><pose>" pose "</pose><parent>" parent "</parent><child>" child             \
    "</child><axis><xyz>0 0 1</xyz><dynamics><damping>1</damping></dynamics></axis></joint>"
    static const char text[] = "<sdf version='1.7'><model name='m'>" LINK("a", "0 0") LINK("b", "0 1") LINK("c", "2 0")
        HINGE("A", "world", "a", "0 0 0 0 0 0") HINGE("B", "a", "b", "0 0 0 0 0 0")
            HINGE("C", "world", "c", "0 0 0 0 0 0") HINGE("D", "b", "c", "0 1 0 0 0 0") "</model></sdf>";
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_workspace *work = NULL;
    CHECK(kempe_model_read_text(context, text, "r.sdf", &model) == KEMPE_OK);
    CHECK(model && kempe_system_new(model, &system) == KEMPE_OK && kempe_workspace_new(system, &work) == KEMPE_OK);
    if (work) {
        double q[4] = {0}, qd[4] = {0}, size = 0;
        CHECK(kempe_model_coordinate_count(model) == 4 && kempe_system_row_count(system) == 3);
        CHECK(kempe_workspace_evaluate(work, 0, q, qd) == KEMPE_OK);
        for (int k = 0; k < 3; k++)
            size = fmax(size, fabs(kempe_workspace_h(work)[k]));
        CHECK_NEAR(size, 0, 1e-15);
    }
    kempe_workspace_free(work);
    kempe_system_free(system);
    kempe_model_free(model);
}

/* -- messages ------------------------------------------------------------------------------------------ */

static void refuse(const char *text, const char *sentence)
{
    foreign_refuse(context, "r.sdf", text, sentence);
}

#define BEGIN "<sdf version='1.9'><model name='m'><link name='a'/><link name='b'/>\n"
#define END   "</model></sdf>"
#define PAIR  "<parent>a</parent><child>b</child>"

static void what_is_refused(void)
{
    refuse("<sdf version='1.3'/>", "r.sdf:1:1: version '1.3' of SDFormat is not read: from 1.4 to 1.11");
    refuse("<sdf/>", "r.sdf:1:1: attribute 'version' is missing here");
    refuse(BEGIN "<joint name='j' type='hinge'>" PAIR "</joint>" END,
           "r.sdf:2:1: joint type 'hinge' is unknown; available: revolute, continuous, prismatic, ball, universal, "
           "revolute2, screw, fixed, gearbox");
    refuse(BEGIN "<joint name='j' type='fixed'><parent>a</parent><child>c</child></joint>" END,
           "r.sdf:2:48: frame 'c' does not exist");
    refuse(BEGIN "<joint name='j' type='revolute'>" PAIR "</joint>" END, "r.sdf:2:1: element 'axis' is missing here");
    refuse(BEGIN "<joint name='j' type='revolute'>" PAIR "<axis><xyz>0 0 0</xyz></axis></joint>" END,
           "r.sdf:2:67: the axis of 'j' is zero: it needs a direction");
    refuse(BEGIN "<link name='a'/>" END,
           "r.sdf:2:1: the name 'm::a' exists twice: links, joints, frames and models share their names");
    refuse(BEGIN "<frame name='f'><pose relative_to='g'/></frame><frame name='g'><pose relative_to='f'/></frame>" END,
           "r.sdf:2:1: frame 'm::f' is given relative to itself, directly or through other frames");
    refuse(BEGIN "<include><uri>model://sun</uri></include>" END,
           "r.sdf:2:1: include 'model://sun' is not a file in this folder: only relative names are read; copy the "
           "model into the folder");
    refuse(BEGIN "<link name='c'><inertial auto='true'/></link>" END,
           "r.sdf:2:16: the inertia of link 'c' is to be computed from its collisions, and it has none with a volume");
    refuse(BEGIN "<link name='c'><pose>1 2 3</pose></link>" END, "r.sdf:2:1: pose '1 2 3' are not 6 numbers");
    refuse(BEGIN "<joint name='g' type='gearbox'>" PAIR
                 "<gearbox_reference_body>a</gearbox_reference_body><axis/><axis2/>"
                 "</joint>" END,
           "r.sdf:2:1: gearbox 'g' needs a hinge about 'axis' between its parent and the reference body");
}

/* Mass and inertia by collisions: a box of 0.2 x 0.4 x 0.6 m at 500 kg/m^3 and a ball of 0.1 m at 1000 kg/m^3. */
static void inertia_by_collisions(void)
{
    static const char text[] =
        BEGIN "<link name='c'><inertial auto='true'><density>500</density></inertial>"
              "<collision name='b'><pose>1 0 0 0 0 0</pose><geometry><box><size>0.2 0.4 "
              "0.6</size></box></geometry></collision>"
              "<collision name='s'><density>1000</density><geometry><sphere><radius>0.1</radius></sphere></geometry>"
              "</collision></link>" END;
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, text, "r.sdf", &model) == KEMPE_OK);
    if (!model)
        return;
    const kmp_body *body = NULL;
    for (int b = 1; b < kmp_model_body_count(model); b++)
        body = strcmp(kmp_model_body(model, b)->name, "c") == 0 ? kmp_model_body(model, b) : body;
    const double box = 24, ball = 1000 * 4 * acos(-1) / 3 * 1e-3, mass = box + ball, com = box / mass;
    const double apart = box * ball / mass, turn = 0.4 * ball * 0.01;
    CHECK(body != NULL);
    if (body) {
        CHECK_NEAR(body->mass.value, mass, 1e-14);
        CHECK_NEAR(body->com[0].value, com, 1e-14);
        CHECK_NEAR(body->inertia[0].value, box / 12 * (0.16 + 0.36) + turn, 1e-13);
        CHECK_NEAR(body->inertia[1].value, box / 12 * (0.04 + 0.36) + turn + apart, 1e-13);
        CHECK_NEAR(body->inertia[2].value, box / 12 * (0.04 + 0.16) + turn + apart, 1e-13);
    }
    kempe_model_free(model);
}

static void what_is_not_used(void)
{
    CHECK_TEXT(foreign_log(context, NULL, OWN ".sdf"),
               "1 /tests/models/folding_arm.sdf:20:40: mesh 'cover.stl' is not in the picture: it is not found in the "
               "model's folder or a folder around it\n"
               "1 /tests/models/folding_arm.sdf: link 'plain' has no joint to the world: it is free to move\n"
               "1 /tests/models/folding_arm.sdf:6:5: 'light' in 'world' is not used\n"
               "2 /tests/models/folding_arm.sdf:21:9: 'collision' in 'link' is not used: surfaces that touch are "
               "entries of contacts\n"
               "2 /tests/models/folding_arm.sdf:83:7: 'plugin' in 'model' is not used: a drive or a force of a joint "
               "moves it\n"
               "2 /tests/models/folding_arm.sdf:35:11: limits of motion are not used: --joint-limits makes them "
               "stops\n");
    foreign_strict(context, OWN ".sdf", 3);
}

/* A model that no joint connects to the world moves freely, unless its base is fixed. */
static void fixed_base(void)
{
    static const char text[] = "<sdf version='1.9'><model name='m'><link name='a'/><link name='b'/><joint name='j' "
                               "type='prismatic'><parent>a</parent><child>b</child><axis/></joint></model></sdf>";
    for (int fixed = 0; fixed < 2; fixed++) {
        kempe_model *model = NULL;
        CHECK(kempe_context_set_base(context, fixed ? "fixed" : NULL) == KEMPE_OK);
        CHECK(kempe_model_read_text(context, text, "r.sdf", &model) == KEMPE_OK);
        CHECK(model && kempe_model_coordinate_count(model) == (fixed ? 1 : 7));
        kempe_model_free(model);
    }
    CHECK(kempe_context_set_base(context, NULL) == KEMPE_OK);
}

static void changed_files(void)
{
    foreign_changed(context, KEMPE_ROOT "/tests/models/r.sdf", OWN ".sdf");
}

int main(void)
{
    context = kempe_context_new();
    TEST(same_in_both_languages);
    TEST(axes_of_versions);
    TEST(poses_of_joints);
    TEST(damped_loop);
    TEST(what_is_refused);
    TEST(inertia_by_collisions);
    TEST(what_is_not_used);
    TEST(fixed_base);
    TEST(changed_files);
    kempe_context_free(context);
    return check_report();
}
