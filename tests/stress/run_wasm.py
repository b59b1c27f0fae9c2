"""Run a WASI program by wasmtime: run_wasm.py PROGRAM ARGUMENT..."""

import sys

import wasmtime

engine = wasmtime.Engine()
store, linker = wasmtime.Store(engine), wasmtime.Linker(engine)
linker.define_wasi()
system = wasmtime.WasiConfig()
system.argv = sys.argv[1:]
system.inherit_stdout()
system.inherit_stderr()
store.set_wasi(system)
instance = linker.instantiate(store, wasmtime.Module.from_file(engine, sys.argv[1]))
try:
    instance.exports(store)["_start"](store)
except wasmtime.ExitTrap as e:
    sys.exit(e.code)
