#pragma once

namespace deepuav {

/// y = x + x, x [1,2,?,?], in OpenVINO's format.
inline constexpr char kDoubling[] = R"(<?xml version="1.0"?>
<net name="doubling" version="11">
  <layers>
    <layer id="0" name="x" type="Parameter" version="opset1">
      <data shape="1,2,?,?" element_type="f32"/>
      <output><port id="0" precision="FP32" names="x"><dim>1</dim><dim>2</dim><dim>-1</dim><dim>-1</dim></port></output>
    </layer>
    <layer id="1" name="y" type="Add" version="opset1">
      <data auto_broadcast="numpy"/>
      <input>
        <port id="0" precision="FP32"><dim>1</dim><dim>2</dim><dim>-1</dim><dim>-1</dim></port>
        <port id="1" precision="FP32"><dim>1</dim><dim>2</dim><dim>-1</dim><dim>-1</dim></port>
      </input>
      <output><port id="2" precision="FP32" names="y"><dim>1</dim><dim>2</dim><dim>-1</dim><dim>-1</dim></port></output>
    </layer>
    <layer id="2" name="y_result" type="Result" version="opset1">
      <input><port id="0" precision="FP32"><dim>1</dim><dim>2</dim><dim>-1</dim><dim>-1</dim></port></input>
    </layer>
  </layers>
  <edges>
    <edge from-layer="0" from-port="0" to-layer="1" to-port="0"/>
    <edge from-layer="0" from-port="0" to-layer="1" to-port="1"/>
    <edge from-layer="1" from-port="2" to-layer="2" to-port="0"/>
  </edges>
</net>
)";

/// y = x rounded to 256 levels from 0 to 25.5, as a quantiser marks it.
inline constexpr char kQuantised[] = R"(<?xml version="1.0"?>
<net name="quantised" version="11">
  <layers>
    <layer id="0" name="x" type="Parameter" version="opset1">
      <data shape="1,2,?,?" element_type="f32"/>
      <output><port id="0" precision="FP32" names="x"><dim>1</dim><dim>2</dim><dim>-1</dim><dim>-1</dim></port></output>
    </layer>
    <layer id="1" name="low" type="Const" version="opset1">
      <data element_type="f32" shape="" offset="0" size="4"/>
      <output><port id="0" precision="FP32"/></output>
    </layer>
    <layer id="2" name="high" type="Const" version="opset1">
      <data element_type="f32" shape="" offset="4" size="4"/>
      <output><port id="0" precision="FP32"/></output>
    </layer>
    <layer id="3" name="y" type="FakeQuantize" version="opset1">
      <data levels="256" auto_broadcast="numpy"/>
      <input>
        <port id="0" precision="FP32"><dim>1</dim><dim>2</dim><dim>-1</dim><dim>-1</dim></port>
        <port id="1" precision="FP32"/>
        <port id="2" precision="FP32"/>
        <port id="3" precision="FP32"/>
        <port id="4" precision="FP32"/>
      </input>
      <output><port id="5" precision="FP32" names="y"><dim>1</dim><dim>2</dim><dim>-1</dim><dim>-1</dim></port></output>
    </layer>
    <layer id="4" name="y_result" type="Result" version="opset1">
      <input><port id="0" precision="FP32"><dim>1</dim><dim>2</dim><dim>-1</dim><dim>-1</dim></port></input>
    </layer>
  </layers>
  <edges>
    <edge from-layer="0" from-port="0" to-layer="3" to-port="0"/>
    <edge from-layer="1" from-port="0" to-layer="3" to-port="1"/>
    <edge from-layer="2" from-port="0" to-layer="3" to-port="2"/>
    <edge from-layer="1" from-port="0" to-layer="3" to-port="3"/>
    <edge from-layer="2" from-port="0" to-layer="3" to-port="4"/>
    <edge from-layer="3" from-port="5" to-layer="4" to-port="0"/>
  </edges>
</net>
)";

inline constexpr int kFoldedChannels = 16, kFold = 4, kFoldedFilters = 64, kFoldedSide = 16;

/// y: x [1,16,16,16] by a kernel as large as its stride.
inline constexpr char kFolding[] = R"(<?xml version="1.0"?>
<net name="folding" version="11">
  <layers>
    <layer id="0" name="x" type="Parameter" version="opset1">
      <data shape="1,16,16,16" element_type="f32"/>
      <output><port id="0" precision="FP32" names="x"><dim>1</dim><dim>16</dim><dim>16</dim><dim>16</dim></port></output>
    </layer>
    <layer id="1" name="weights" type="Const" version="opset1">
      <data element_type="f32" shape="64,16,4,4" offset="0" size="65536"/>
      <output><port id="0" precision="FP32"><dim>64</dim><dim>16</dim><dim>4</dim><dim>4</dim></port></output>
    </layer>
    <layer id="2" name="y" type="Convolution" version="opset1">
      <data strides="4,4" dilations="1,1" pads_begin="0,0" pads_end="0,0" auto_pad="explicit"/>
      <input>
        <port id="0" precision="FP32"><dim>1</dim><dim>16</dim><dim>16</dim><dim>16</dim></port>
        <port id="1" precision="FP32"><dim>64</dim><dim>16</dim><dim>4</dim><dim>4</dim></port>
      </input>
      <output><port id="2" precision="FP32" names="y"><dim>1</dim><dim>64</dim><dim>4</dim><dim>4</dim></port></output>
    </layer>
    <layer id="3" name="y_result" type="Result" version="opset1">
      <input><port id="0" precision="FP32"><dim>1</dim><dim>64</dim><dim>4</dim><dim>4</dim></port></input>
    </layer>
  </layers>
  <edges>
    <edge from-layer="0" from-port="0" to-layer="2" to-port="0"/>
    <edge from-layer="1" from-port="0" to-layer="2" to-port="1"/>
    <edge from-layer="2" from-port="2" to-layer="3" to-port="0"/>
  </edges>
</net>
)";

}  // namespace deepuav
