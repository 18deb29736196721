"""Peers written by others: npm's modbus-stream over TCP as slave and as master, minimalmodbus over a serial line."""

import json
import os
import shutil
import subprocess
import sys

import pytest

from transports.errors import ExceptionReply
from transports.modbus_ascii import ModbusAscii
from transports.open_link import open_link
from transports.serve import serve
from transports.tcp import TcpLink

PEER = "modbus-stream@0.46.0"

SLAVE = """
const modbus = require("modbus-stream");
const coils = new Array(32).fill(0), registers = new Array(128).fill(0);
const word = (value) => { const block = Buffer.alloc(2); block.writeUInt16BE(value); return block; };
const there = (at, count, all) => at + count <= all.length;
const serve = (connection) => {
  connection.on("error", () => {});
  const on = (name, act) => connection.on(name, (req, reply) => act(req.request, reply));
  const bits = ({ address, quantity }, reply) => there(address, quantity, coils)
    ? reply(null, coils.slice(address, address + quantity)) : reply("IllegalDataAddress");
  const words = ({ address, quantity }, reply) => there(address, quantity, registers)
    ? reply(null, registers.slice(address, address + quantity).map(word)) : reply("IllegalDataAddress");
  on("read-coils", bits);
  on("read-discrete-inputs", bits);
  on("read-holding-registers", words);
  on("read-input-registers", words);
  on("write-single-coil", ({ address, value }, reply) => { coils[address] = value; reply(null, address, value); });
  on("write-single-register", ({ address, value }, reply) => {
    registers[address] = value.readUInt16BE(0); reply(null, address, value); });
  on("write-multiple-registers", ({ address, values }, reply) => {
    values.forEach((value, place) => { registers[address + place] = value.readUInt16BE(0); });
    reply(null, address, values.length); });
};
const server = modbus.drivers.tcp.server({ debug: null }).attach(modbus.transports.ascii.prepare({}), serve);
server.listen(0, "127.0.0.1", () => console.log(server.address().port));
process.stdin.on("end", () => process.exit(0)).resume();
"""

MASTER = """
const modbus = require("modbus-stream");
const extra = { slaveId: 255 }, options = { debug: null, retry: 2000 };
const word = (value) => { const block = Buffer.alloc(2); block.writeUInt16BE(value); return block; };
const told = [];
const requests = [
  ["writeMultipleRegisters", { address: 0x50, values: [word(0x80), word(0)] }],
  ["writeSingleRegister", { address: 0x10, value: word(0xBEEF) }],
  ["writeSingleCoil", { address: 3, value: 1 }],
  ["writeMultipleCoils", { address: 8, values: [1, 0, 1] }],
  ["readHoldingRegisters", { address: 0x50, quantity: 2 }],
  ["readInputRegisters", { address: 0x50, quantity: 2 }],
  ["readCoils", { address: 0, quantity: 8 }],
];
modbus.drivers.tcp.connect(+process.argv.at(-1), "127.0.0.1", options)
  .attach(modbus.transports.ascii.prepare(options), (err, connection) => {
    if (err) throw err;
    connection.on("error", () => {});
    const next = () => {
      if (requests.length === 0) { console.log(JSON.stringify(told)); process.exit(0); }
      const [name, what] = requests.shift();
      connection[name]({ ...what, extra }, (error, info) => {
        const data = error ? error.message : info.response.data;
        told.push(Array.isArray(data) ? data.map((one) => Buffer.isBuffer(one) ? one.readUInt16BE(0) : one) : data);
        next();
      });
    };
    next();
  });
"""


@pytest.fixture(scope="module")
def peer(request):
    """Return the folder in which node finds the peer, installed once."""
    if not shutil.which("npm"):
        if os.environ.get("CI") == "true":
            pytest.fail("npm is missing: install it, the independent Modbus peer comes from there")
        pytest.skip("npm is missing")
    folder = request.config.cache.mkdir("npm")
    if not (folder / "node_modules" / "modbus-stream").is_dir():
        command = [
            "npm",
            "install",
            "--no-audit",
            "--no-fund",
            "--ignore-scripts",
            "--omit=optional",
            "--prefix",
            ".",
        ]
        done = subprocess.run([*command, PEER], cwd=folder, capture_output=True, text=True, timeout=100, check=False)
        assert done.returncode == 0, done.stderr
    return folder


def start(script, folder, *arguments):
    return subprocess.Popen(
        ["node", "-e", script, "--", *arguments],
        cwd=folder,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def test_masters_an_independent_slave_over_tcp(peer, real_clock):
    with start(SLAVE, peer) as slave:
        port = int(slave.stdout.readline())
        modbus = ModbusAscii(lambda: TcpLink("127.0.0.1", port, real_clock), real_clock)
        modbus.write_registers(0x50, [0x80, 0])
        modbus.write_register(0x10, 0xBEEF)
        modbus.write_coil(3, value=True)
        modbus.write_coil(12, value=True)
        assert modbus.read_holding_registers(0x50, 2).values == (0x80, 0)
        assert modbus.read_input_registers(0x10, 1).values == (0xBEEF,)
        assert modbus.read_coils(0, 16).values == (0, 0, 0, 1, *[0] * 8, 1, 0, 0, 0)
        assert modbus.read_discrete_inputs(1, 3).values == (0, 0, 1)
        assert len(modbus.read_holding_registers(0, 125).values) == 125
        with pytest.raises(ExceptionReply, match="illegal address"):
            modbus.read_holding_registers(127, 2)
        modbus.close()
        slave.stdin.close()
        assert slave.wait(10) == 0


def test_answers_an_independent_master_over_tcp(peer, unit, real_clock):
    with serve(unit, real_clock, "tcp://127.0.0.1:0") as server:
        port = server.address.rsplit(":", 1)[1]
        with start(MASTER, peer, port) as master:
            told = json.loads(master.communicate(timeout=20)[0])
    assert told[4:6] == [[0x150, 0x151], [0x250, 0x251]]
    assert told[6] == [0x9E3779B1 * 3 >> place & 1 for place in range(8)]
    assert unit.bank.written == {
        ("register", 0x50): 0x80,
        ("register", 0x51): 0,
        ("register", 0x10): 0xBEEF,
        ("coil", 3): True,
        ("coil", 8): True,
        ("coil", 9): False,
        ("coil", 10): True,
    }


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are a matter of POSIX")
def test_answers_an_independent_master_over_a_serial_line(unit, real_clock):
    import minimalmodbus

    with serve(unit, real_clock, "pty:", baud=9600) as server:
        port = server.address.removeprefix("serial://")
        master = minimalmodbus.Instrument(port, 255, mode=minimalmodbus.MODE_ASCII)
        master.serial.baudrate = 9600
        master.serial.timeout = 1.0
        master.write_registers(0x50, [0x80, 0])
        master.write_bit(3, 1)
        master.write_register(0x10, 0xBEEF, functioncode=6)
        assert master.read_registers(0x50, 2) == [0x150, 0x151]
        assert master.read_registers(0x12, 3, functioncode=4) == [0x212, 0x213, 0x214]
        assert master.read_bits(0, 8, functioncode=1) == [0x9E3779B1 * 3 >> place & 1 for place in range(8)]
        with pytest.raises(minimalmodbus.SlaveReportedException):
            master.read_registers(0xFFFF, 2)
        master.serial.close()
    assert unit.bank.written == {
        ("register", 0x50): 0x80,
        ("register", 0x51): 0,
        ("coil", 3): True,
        ("register", 0x10): 0xBEEF,
    }


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are a matter of POSIX")
def test_masters_its_own_slave_over_a_paced_serial_line(unit, real_clock):
    with serve(unit, real_clock, "pty:", baud=9600) as server:
        modbus = ModbusAscii(lambda: open_link(server.address, real_clock), real_clock)
        answer = modbus.read_input_registers(0, 6)
        modbus.close()
    assert answer.values == tuple(0x100 + place for place in range(6))
