// The Python module lodestone._lodestone. What users see of it is in lodestone/__init__.py.
#include "apps/machine.h"
#include "apps/python/binding.h"
#include "base/threads.h"

namespace lodestone::python {

namespace {

// Of the package, made by __init__.py before it loads this module.
py::object exception_for(Fault fault) {
    const char* name = "Error";
    switch (fault) {
        case Fault::invariant:
            name = "InvariantError";
            break;
        case Fault::usage:
            name = "UsageError";
            break;
        case Fault::format:
            name = "FormatError";
            break;
        case Fault::machine:
            name = "MachineError";
            break;
        case Fault::interrupted:
            name = "Interrupted";
            break;
    }
    return py::module_::import("lodestone._errors").attr(name);
}

}  // namespace

}  // namespace lodestone::python

PYBIND11_MODULE(_lodestone, module) {
    using namespace lodestone::python;
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            if (thrown) std::rethrow_exception(thrown);
        } catch (const Failure& failure) {
            PyErr_SetString(exception_for(failure.error.fault).ptr(), failure.error.message.c_str());
        }
    });
    module.attr("version") = LODESTONE_VERSION;
    module.attr("commit") = lodestone::source_commit();
#ifdef LODESTONE_WITH_RENDER
    module.attr("draws") = true;
#else
    module.attr("draws") = false;
#endif
    module.def("set_threads", [](unsigned threads) { lodestone::set_thread_count(threads); });
    bind_meshes(module);
    bind_assets(module);
    bind_atlases(module);
}
