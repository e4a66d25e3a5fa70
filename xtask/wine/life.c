/* Loads the FMU's library, leads an instance through its life, and unloads it, twenty times: what an importer written in C
 * does, on Windows and elsewhere. Prints what the library said and computed; ends with 1 where a promise is broken.
 *
 *     life LIBRARY GUID
 *
 * Value references are those of modelDescription.xml, which never change.
 */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#define LOAD(path) ((void *)LoadLibraryA(path))
#define FIND(library, name) ((void *)GetProcAddress((HMODULE)(library), name))
#define UNLOAD(library) (FreeLibrary((HMODULE)(library)) != 0)
#else
#include <dlfcn.h>
#define LOAD(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define FIND(library, name) dlsym(library, name)
#define UNLOAD(library) (dlclose(library) == 0)
#endif

enum { OK = 0, ERROR_STATUS = 3, LIVES = 20 };
enum { POINT_SPACING = 1301, THREADS = 1312, MATERIAL = 1100, VELOCITY = 1 };

typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);
typedef struct {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;

/* The 34 functions that an importer looks up. */
static const char *const NAMES[] = {
    "fmi2GetTypesPlatform", "fmi2GetVersion", "fmi2SetDebugLogging", "fmi2Instantiate", "fmi2FreeInstance",
    "fmi2SetupExperiment", "fmi2EnterInitializationMode", "fmi2ExitInitializationMode", "fmi2Terminate", "fmi2Reset",
    "fmi2GetReal", "fmi2GetInteger", "fmi2GetBoolean", "fmi2GetString", "fmi2SetReal", "fmi2SetInteger",
    "fmi2SetBoolean", "fmi2SetString", "fmi2GetFMUstate", "fmi2SetFMUstate", "fmi2FreeFMUstate",
    "fmi2SerializedFMUstateSize", "fmi2SerializeFMUstate", "fmi2DeSerializeFMUstate", "fmi2GetDirectionalDerivative",
    "fmi2SetRealInputDerivatives", "fmi2GetRealOutputDerivatives", "fmi2DoStep", "fmi2CancelStep", "fmi2GetStatus",
    "fmi2GetRealStatus", "fmi2GetIntegerStatus", "fmi2GetBooleanStatus", "fmi2GetStringStatus"};

static const struct { const char *name; uint32_t reference; } OUTPUTS[] = {
    {"cutting_force", 100}, {"thrust_force", 101}, {"chip_temperature", 104}, {"peak_strain", 106},
    {"chip_thickness", 108}, {"energy.tool_work", 114}, {"energy.plastic", 117}, {"energy.balance_error", 123},
    {"tool_position_x", 129}};
enum { OUTPUT_COUNT = sizeof OUTPUTS / sizeof OUTPUTS[0] };

static char last_message[2000];

/* A logger as the standard has it: the format and what it names, which only C can receive. */
static void keep_message(void *environment, const char *name, int status, const char *category, const char *format, ...) {
    va_list arguments;
    (void)environment, (void)name, (void)status, (void)category;
    va_start(arguments, format);
    vsnprintf(last_message, sizeof last_message, format, arguments);
    va_end(arguments);
}

static void demand(int holds, const char *what) {
    if (!holds) {
        printf("broken: %s; last message: %s\n", what, last_message);
        exit(1);
    }
}

static void read_outputs(void *library, void *one, double *values) {
    int (*get)(void *, const uint32_t *, size_t, double *) = FIND(library, "fmi2GetReal");
    for (int i = 0; i < OUTPUT_COUNT; i++) demand(get(one, &OUTPUTS[i].reference, 1, &values[i]) == OK, OUTPUTS[i].name);
}

/* One life; gives the outputs after 4 steps of `h` seconds, of which the last is made again from a saved state and from its
 * bytes. `points_apart` (m) decides how many points there are, and 4,000 of them make a thread worth while. */
static void life(void *library, const char *guid, double points_apart, double h, double *values) {
    void *(*instantiate)(const char *, int, const char *, const char *, const Callbacks *, int, int) =
        FIND(library, "fmi2Instantiate");
    int (*set_real)(void *, const uint32_t *, size_t, const double *) = FIND(library, "fmi2SetReal");
    int (*set_integer)(void *, const uint32_t *, size_t, const int *) = FIND(library, "fmi2SetInteger");
    int (*set_string)(void *, const uint32_t *, size_t, const char *const *) = FIND(library, "fmi2SetString");
    int (*enter)(void *) = FIND(library, "fmi2EnterInitializationMode");
    int (*leave)(void *) = FIND(library, "fmi2ExitInitializationMode");
    int (*step)(void *, double, double, int) = FIND(library, "fmi2DoStep");
    int (*save)(void *, void **) = FIND(library, "fmi2GetFMUstate");
    int (*restore)(void *, void *) = FIND(library, "fmi2SetFMUstate");
    int (*forget)(void *, void **) = FIND(library, "fmi2FreeFMUstate");
    int (*size_of)(void *, void *, size_t *) = FIND(library, "fmi2SerializedFMUstateSize");
    int (*write)(void *, void *, char *, size_t) = FIND(library, "fmi2SerializeFMUstate");
    int (*parse)(void *, const char *, size_t, void **) = FIND(library, "fmi2DeSerializeFMUstate");
    void (*release)(void *) = FIND(library, "fmi2FreeInstance");
    Callbacks callbacks = {keep_message, calloc, free, NULL, NULL};
    const uint32_t spacing = POINT_SPACING, threads = THREADS, material = MATERIAL, velocity = VELOCITY;
    const double too_fast = 900.0;
    const int two = 2;
    const char *steel = "AISI 1045";
    double again[OUTPUT_COUNT];
    void *state = NULL, *copy = NULL;
    size_t size = 0;

    demand(instantiate("one", 1, "{another}", NULL, &callbacks, 0, 0) == NULL, "a wrong GUID is refused");
    demand(strstr(last_message, "GUID {another} belongs to another version") != NULL, "the message says why");
    void *one = instantiate("one", 1, guid, "file:///C:/my%20FMUs/resources", &callbacks, 0, 1);
    demand(one != NULL, "an instance is made");
    demand(set_real(one, &velocity, 1, &too_fast) == ERROR_STATUS, "900 m/s are refused");
    demand(strstr(last_message, "tool_velocity = 900 m/s is outside [-500, 500] m/s") != NULL, "the message names the range");
    demand(set_real(one, &spacing, 1, &points_apart) == OK, "the spacing is set");
    demand(set_integer(one, &threads, 1, &two) == OK, "the threads are set");
    demand(set_string(one, &material, 1, &steel) == OK, "the material is set");
    demand(enter(one) == OK && leave(one) == OK, "the model is built");
    for (int i = 0; i < 3; i++) demand(step(one, i * h, h, 1) == OK, "a step is made");
    demand(save(one, &state) == OK, "the state is saved");
    demand(step(one, 3 * h, h, 1) == OK, "the last step is made");
    read_outputs(library, one, values);
    demand(restore(one, state) == OK && step(one, 3 * h, h, 1) == OK, "it goes on from the saved state");
    read_outputs(library, one, again);
    demand(memcmp(values, again, sizeof again) == 0, "the saved state leads to the same bits");
    demand(size_of(one, state, &size) == OK, "the state has a size");
    char *bytes = malloc(size);
    demand(bytes != NULL && write(one, state, bytes, size) == OK, "the state becomes bytes");
    demand(parse(one, bytes, size, &copy) == OK, "and bytes a state");
    demand(restore(one, copy) == OK && step(one, 3 * h, h, 1) == OK, "it goes on from the bytes");
    read_outputs(library, one, again);
    demand(memcmp(values, again, sizeof again) == 0, "the bytes lead to the same bits");
    bytes[size / 2] ^= 1;
    copy = NULL;
    demand(parse(one, bytes, size, &copy) == ERROR_STATUS && copy == NULL, "damaged bytes are refused");
    free(bytes);
    demand(forget(one, &state) == OK && state == NULL, "the state is freed");
    release(one);
}

int main(int count, char **arguments) {
    double first[OUTPUT_COUNT], values[OUTPUT_COUNT], threaded[OUTPUT_COUNT];
    demand(count == 3, "arguments are LIBRARY GUID");
    for (int i = 0; i < LIVES; i++) {
        void *library = LOAD(arguments[1]);
        demand(library != NULL, "the library is loaded");
        for (size_t k = 0; k < sizeof NAMES / sizeof NAMES[0]; k++) demand(FIND(library, NAMES[k]) != NULL, NAMES[k]);
        const char *(*version)(void) = FIND(library, "fmi2GetVersion");
        demand(strcmp(version(), "2.0") == 0, "the version is 2.0");
        life(library, arguments[2], 4e-5, 1e-6, values);
        if (i == 0) life(library, arguments[2], 1.5e-5, 1e-7, threaded); /* 13,000 points on two threads */
        if (i == 0) memcpy(first, values, sizeof first);
        demand(memcmp(first, values, sizeof first) == 0, "every life gives the same bits");
        demand(UNLOAD(library), "the library is unloaded");
    }
    for (int i = 0; i < OUTPUT_COUNT; i++) printf("%s %.17g\n", OUTPUTS[i].name, first[i]);
    for (int i = 0; i < OUTPUT_COUNT; i++) printf("threads:%s %.17g\n", OUTPUTS[i].name, threaded[i]);
    return 0;
}
