// Callbacks that throw: the exception reaches the host, and the instance goes on.
// Argument: a scene file that is alone in its folder.
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>

#include "cutis.hpp"

#undef NDEBUG
#include <cassert>

extern "C" {
void *fmi3InstantiateCoSimulation(const char *, const char *, const char *, uint8_t, uint8_t, uint8_t, uint8_t,
                                  const uint32_t *, size_t, void *, void (*)(void *, int, const char *, const char *),
                                  void (*)(void *, double, uint8_t, uint8_t, uint8_t, uint8_t, uint8_t *, double *));
void fmi3FreeInstance(void *);
int fmi3EnterInitializationMode(void *, uint8_t, double, double, uint8_t, double);
int fmi3ExitInitializationMode(void *);
int fmi3SetFloat64(void *, const uint32_t *, size_t, const double *, size_t);
int fmi3GetFloat64(void *, const uint32_t *, size_t, double *, size_t);
int fmi3SetDebugLogging(void *, uint8_t, size_t, const char *const *);
int fmi3DoStep(void *, double, double, uint8_t, uint8_t *, uint8_t *, uint8_t *, double *);
struct Functions2 {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *allocate, *release, *finished, *environment;
};
void *fmi2Instantiate(const char *, int, const char *, const char *, const Functions2 *, int, int);
void fmi2FreeInstance(void *);
int fmi2SetupExperiment(void *, int, double, double, int, double);
int fmi2DoStep(void *, double, double, int);
}

static int told = 0;

static void three(void *, int, const char *, const char *message) {
    ++told;
    throw std::runtime_error(message);
}
static void two(void *, const char *, int, const char *, const char *, ...) {
    ++told;
    throw std::runtime_error("two");
}

// Intermediate updates: counts pieces, and throws at the one that is asked for.
static int piece = 0, throws_at = 0;
static void update(void *, double, uint8_t, uint8_t, uint8_t, uint8_t, uint8_t *, double *) {
    if (++piece == throws_at) throw std::runtime_error("update");
}

template <class Call> static std::string thrown(Call call) {
    try {
        call();
    } catch (const std::runtime_error &error) {
        return error.what();
    }
    return "";
}

int main(int, char **argv) {
    const std::string path = argv[1], folder = path.substr(0, path.rfind('/') + 1);
    const std::string token = cutis::Sim::from_file(path).token();
    assert(thrown([&] {
               fmi3InstantiateCoSimulation("a", "{wrong}", folder.c_str(), 0, 1, 0, 0, nullptr, 0, nullptr, three, nullptr);
           }).find("token") != std::string::npos);
    void *i = fmi3InstantiateCoSimulation("a", token.c_str(), folder.c_str(), 0, 1, 0, 0, nullptr, 0, nullptr, three, nullptr);
    assert(i && told == 1);
    assert(fmi3EnterInitializationMode(i, 0, 0, 0, 0, 0) == 0);
    // The equilibrium is told of once it is found, and stands whatever the host does then.
    assert(!thrown([&] { fmi3ExitInitializationMode(i); }).empty());
    const uint32_t bones = 10, gap = 77;
    const double d[6] = {0, 0, 0, 0.002, 0, 0};
    double out[6] = {0}, t = 0;
    uint8_t a, b, c;
    assert(fmi3SetFloat64(i, &bones, 1, d, 6) == 0);
    assert(!thrown([&] { fmi3DoStep(i, 0, 0.1, 0, &a, &b, &c, &t); }).empty());
    assert(t == 0.1);
    assert(fmi3SetDebugLogging(i, 0, 0, nullptr) == 0);
    assert(fmi3DoStep(i, t, 0.1, 0, &a, &b, &c, &t) == 0);
    assert(fmi3GetFloat64(i, &bones, 1, out, 6) == 0 && out[3] == 0.002);
    assert(fmi3SetDebugLogging(i, 1, 0, nullptr) == 0);
    assert(thrown([&] { fmi3GetFloat64(i, &gap, 1, out, 1); }).find("77") != std::string::npos);
    fmi3FreeInstance(i);

    // A step in pieces: an exception before its end leaves the step before, one at its end the step itself.
    const uint32_t turns = 11, forces = 120;
    const double far[6] = {0, 0, 0, 2.5, 0, 0};
    int pieces = 0;
    double first[6] = {0};
    for (int at : {0, 1, -1}) {
        void *k = fmi3InstantiateCoSimulation("c", token.c_str(), folder.c_str(), 0, 0, 0, 0, nullptr, 0, nullptr, three, update);
        assert(k && fmi3EnterInitializationMode(k, 0, 0, 0, 0, 0) == 0 && fmi3ExitInitializationMode(k) == 0);
        assert(fmi3SetFloat64(k, &turns, 1, far, 6) == 0);
        piece = 0;
        throws_at = at < 0 ? pieces : at;
        double end = 0;
        const std::string what = thrown([&] { assert(fmi3DoStep(k, 0, 0.1, 0, &a, &b, &c, &end) == 0); });
        assert(what == (at == 0 ? "" : "update"));
        if (at == 0) {
            pieces = piece;
            assert(pieces > 1);
        }
        throws_at = 0;
        if (at == 1) assert(fmi3DoStep(k, 0, 0.1, 0, &a, &b, &c, &end) == 0);
        assert(fmi3GetFloat64(k, &forces, 1, at == 0 ? first : out, 6) == 0);
        if (at != 0) assert(std::memcmp(first, out, sizeof out) == 0);
        assert(fmi3DoStep(k, 0.1, 0.1, 0, &a, &b, &c, &end) == 0 && end == 0.2);
        fmi3FreeInstance(k);
    }

    const Functions2 functions{two, nullptr, nullptr, nullptr, nullptr};
    void *j = fmi2Instantiate("b", 1, token.c_str(), folder.c_str(), &functions, 0, 1);
    assert(j && fmi2SetupExperiment(j, 0, 0, 0, 0, 0) == 0);
    assert(thrown([&] { fmi2DoStep(j, 0, 0.1, 0); }) == "two");
    fmi2FreeInstance(j);
    assert(told >= 5);
    std::puts("throws: all is well");
    return 0;
}
