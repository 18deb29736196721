"""The TC410 drive: Modbus ASCII registers, slews by its landing law, and its simulator."""
